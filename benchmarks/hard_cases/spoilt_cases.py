"""Hard cases of the full model: starts that no one would choose, or that hold no numbers."""

from __future__ import annotations

import dataclasses
from functools import partial

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsph import FullModel, NeighborSearch, ParticleState
from jaxsph.arrangements import Lattice
from jaxsph.integrate import FaultCode
from jaxsph.scenes import Scene, taylor_green
from jaxsph.scenes.taylor_green import REFERENCE_DENSITY
from jaxsph.schemes import DeltaPlus

from .bounds import (
    AT_REST,
    FAST,
    LOOSE_DENSITY,
    RELEASE,
    SCATTERED,
    VORTEX,
)
from .full_cases import every
from .judge import Case, Ending, Run

RANDOM_PARTICLES = 64
_ANY = (Ending.FINISHED, Ending.FAULT)


def _with(scene: Scene, position, velocity, density) -> Run:
    state = ParticleState(position, velocity, density)
    return Run(dataclasses.replace(scene, state=state), every(scene, 2))


def _vortex() -> Scene:
    return taylor_green(16, end_time=0.5, scheme=DeltaPlus(), dtype="float64")


def _at_rest(position: Array) -> tuple[Array, Array, Array]:
    density = jnp.full(position.shape[0], REFERENCE_DENSITY, position.dtype)
    return position, jnp.zeros_like(position), density


def _two_at_one_place(moving: bool) -> Run:
    scene = _vortex()
    s = scene.state
    position = s.position.at[1].set(s.position[0])
    fields = (position, s.velocity, s.density) if moving else _at_rest(position)
    return _with(scene, *fields)


def _without(empty) -> Run:
    """A vortex without the particles that `empty` tells from positions (N, n)."""
    scene = _vortex()
    kept = ~empty(np.asarray(scene.state.position))
    s = scene.state
    return _with(scene, s.position[kept], s.velocity[kept], s.density[kept])


def _hole(position):
    return np.linalg.norm(position - 0.5, axis=1) < 0.25


def _right_half(position):
    return position[:, 0] > 0.5


def _some(count: int) -> Run:
    scene = _vortex()
    s = scene.state
    return _with(scene, s.position[:count], s.velocity[:count], s.density[:count])


def _squeezed(factor: float) -> Run:
    """All particles drawn together towards the middle of the box, at rest."""
    scene = _vortex()
    return _with(scene, *_at_rest(0.5 + factor * (scene.state.position - 0.5)))


def _spoilt(field: str, value: float) -> Run:
    """A vortex with one number of particle 5 replaced."""
    scene = _vortex()
    fields = {n: getattr(scene.state, n) for n in ("position", "velocity", "density")}
    array = fields[field]
    fields[field] = array.at[(5, 0) if array.ndim == 2 else 5].set(value)
    return _with(scene, **fields)


def random_start(position: Float[np.ndarray, "particles dim"]) -> Run:
    """Particles at rest anywhere in the periodic unit square, with room for all in one place.

    Args:
        position: of `RANDOM_PARTICLES` particles [m].
    """
    base = taylor_green(
        8, h_over_dx=1.2, end_time=0.5, arrangement=Lattice(), scheme=DeltaPlus(), dtype="float64"
    )
    run = _with(base, *_at_rest(jnp.asarray(position)))
    found = base.search()
    # capacities do not depend on where particles are, so that one program serves all starts
    search = NeighborSearch(
        found.grid, found.support, found.skin, RANDOM_PARTICLES - 1, RANDOM_PARTICLES
    )
    return dataclasses.replace(run, model=FullModel(base.functional(), search))


def _uniform(seed: int) -> Run:
    return random_start(np.random.default_rng(seed).uniform(size=(RANDOM_PARTICLES, 2)))


_NAMED = {"endings": (Ending.FAULT,), "codes": (FaultCode.NOT_FINITE,), "says": "not finite"}

SPOILT = (
    Case("start/two-at-one-place", "a vortex with two particles at the same place",
         partial(_two_at_one_place, True), tuple(b for b in VORTEX if b.name in (
             "density", "energy over start", "momentum drift"))),
    Case("start/two-at-one-place-at-rest", "the same at rest: nothing parts the two",
         partial(_two_at_one_place, False), (LOOSE_DENSITY, AT_REST)),
    Case("start/hole", "a vortex with an empty disc of a quarter of the box's length",
         partial(_without, _hole), (LOOSE_DENSITY, FAST, RELEASE), endings=_ANY),
    Case("start/half-empty", "a vortex in the left half of the box, the right half empty",
         partial(_without, _right_half), endings=(Ending.REFUSED,), says="particles"),
    Case("start/one-particle", "a single particle alone in the box",
         partial(_some, 1), endings=(Ending.REFUSED,), says="particles"),
    Case("start/two-particles", "two neighbours alone in the box",
         partial(_some, 2), endings=(Ending.REFUSED,), says="particles"),
    Case("start/one-cell", "all particles in one cell of the neighbour search",
         partial(_squeezed, 0.06), SCATTERED, endings=_ANY),
    Case("start/one-place", "all particles at one place, at rest: no force parts them",
         partial(_squeezed, 0.0), (LOOSE_DENSITY, AT_REST), endings=_ANY),
    *(Case(f"start/nan-{field}", f"a NaN in the {field} of one particle at the start",
           partial(_spoilt, field, np.nan), **_NAMED)
      for field in ("position", "velocity", "density")),
    Case("start/infinite-velocity", "an infinite velocity of one particle at the start",
         partial(_spoilt, "velocity", np.inf), **_NAMED),
    *(Case(f"start/random-{seed}", f"64 particles at random places, at rest (seed {seed})",
           partial(_uniform, seed), SCATTERED, endings=_ANY) for seed in range(3)),
)  # fmt: skip
