"""A start without sound."""

from __future__ import annotations

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.scipy.sparse.linalg import cg
from jaxtyping import Array

from ..pairs import PairTerm, pair_sum
from ..particles import ParticleState
from .scene import Scene

_SMOOTHINGS = 6  # by the kernel; with 2 the noise of disordered particles is balanced too


def smoothing_sum(pair, i, j):
    """f_j W_ij V_j"""
    return j.value * pair.kernel * j.volume


_SMOOTHING = (PairTerm("smoothing_sum", ("value",), smoothing_sum),)


def balanced(
    scene: Scene, tolerance: float = 1e-2, iterations: int = 200, near: Scene | None = None
) -> Scene:
    """The scene with densities at the start whose pressure balances the flow:

        S d^2 rho / dt^2 = 0    for rho = rho_given + S z, at the same mean density.

    A pressure in closed form balances the flow of the continuum, not the sums over particles; the
    difference sets out as sound. Here the second derivative is that of the scene's own functional
    along its own rates (`jax.jvp`), an elliptic operator of the density; S smooths by the kernel,
    as sums over disordered particles have a noise that is not to be balanced. Solved by conjugate
    gradients.

    Args:
        scene: periodic; its positions and velocities stay, its densities are a first guess.
        tolerance: of the residual, relative to that of the densities given.
        iterations: at most.
        near: a balanced scene of the same particles, from whose densities the solver sets out; it
            is there at once where the two differ in viscosity alone.

    Raises:
        ValueError: if the scene has walls, or no better balance is found.
    """
    if scene.walls is not None:
        raise ValueError("balanced: a scene with walls starts from rest; leave it as it is.")
    guess = scene.state.density
    if near is not None:
        if near.state.density.shape != guess.shape:
            raise ValueError(
                f"near: has {len(near.state.density)} particles, the scene {len(guess)}; balance "
                "it by itself."
            )
        guess = near.state.density + (jnp.mean(guess) - jnp.mean(near.state.density))
    neighbors = scene.search().build(scene.state.position)
    density, before, after = _solved(
        scene.functional(), scene.state, guess, neighbors, tolerance, iterations
    )
    if not float(after) <= float(before):  # a NaN too
        raise ValueError(
            f"balanced: the imbalance went from {float(before):.3g} to {float(after):.3g}; "
            "start from particles that are more even, or leave the scene as it is."
        )
    start = dataclasses.replace(scene.state, density=density)
    return dataclasses.replace(scene, state=start, solution=scene.exact)


@eqx.filter_jit
def _solved(functional, state, guess, neighbors, tolerance: float, iterations: int):
    space, time = functional.space, jnp.zeros((), state.density.dtype)
    volume = jnp.full_like(state.density, space.spacing**space.box.dim)
    itself = space.kernel.value(time, space.smoothing_length, space.box.dim)

    def smoothed(values: Array) -> Array:
        for _ in range(_SMOOTHINGS):
            fields = {"position": state.position, "volume": volume, "value": values}
            fields = {name: neighbors.sort(field) for name, field in fields.items()}
            sums = pair_sum(_SMOOTHING, fields, space, neighbors)["smoothing_sum"]
            values = neighbors.unsort(sums) + itself * volume * values
        return values - jnp.mean(values)

    def second_derivative(density: Array) -> Array:
        start = ParticleState(state.position, state.velocity, density)
        rates = functional(time, start, neighbors)
        return jax.jvp(lambda s: functional(time, s, neighbors).density, (start,), (rates,))[1]

    before = jnp.linalg.norm(smoothed(second_derivative(state.density)))
    residual, slope = jax.linearize(second_derivative, guess)

    def operator(change):  # minus a smoothed Laplacian times c0^2: positive
        return -smoothed(slope(smoothed(change)))

    wanted = smoothed(residual)
    change, _ = cg(operator, wanted, tol=0.0, atol=tolerance * before, maxiter=iterations)
    left = wanted - operator(change)
    return guess + smoothed(change), before, jnp.linalg.norm(left)
