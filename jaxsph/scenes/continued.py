"""Scenes that go on from a run at another resolution."""

from __future__ import annotations

import dataclasses

import equinox as eqx
import jax.numpy as jnp

from ..interpolation import MovingLeastSquaresMap
from ..pairs import Space
from ..particles import ParticleState, in_dtype
from .scene import Scene


def continued(scene: Scene, state: ParticleState, space: Space) -> Scene:
    """The scene with the velocity and density of another run of it, at its own particles.

    A steady flow is reached sooner from the steady flow at a coarser resolution than from rest.
    The fields are carried by first-order moving least squares (`MovingLeastSquaresMap`). The other
    run's spacing is recorded among the parameters, so that no run from rest is taken for this one.

    Args:
        scene: whose particles are kept.
        state: of the other run.
        space: of the other run, which says how far its particles reach.

    Raises:
        ValueError: if particles come in and go out, the runs are in different boxes, or the other
            run's particles have clumped or leave a place without any.
    """
    if scene.parking is not None:
        raise ValueError(
            "scene: particles come in and go out of it, and those of the other run are not its "
            "own; let it run from its start."
        )
    if space.box != scene.space.box:
        raise ValueError("box: the two runs are in different boxes; name a run of the same scene.")
    carry = MovingLeastSquaresMap.allocate(scene.state.position, space)
    fields = jnp.concatenate([state.density[:, None], state.velocity], axis=1)
    values, overflow = eqx.filter_jit(carry)(state.position, fields)
    if bool(overflow):
        raise ValueError("state: its particles have clumped; name an earlier one.")
    if not bool(jnp.isfinite(values).all()):
        raise ValueError("state: it is lost or leaves a place without particles; name another one.")
    found = ParticleState(scene.state.position, values[:, 1:], values[:, 0])
    return dataclasses.replace(
        scene,
        state=in_dtype(found, scene.state.density.dtype),
        parameters={**scene.parameters, "continued_from_spacing": space.spacing},
    )
