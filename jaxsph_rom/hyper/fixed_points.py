"""What of a scene acts at points that do not move."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsph import SPHFunctional
from jaxsph.effects import (
    BodyForce,
    Effect,
    IsotropicViscosity,
    LaminarViscosity,
    ParticleShifting,
    ShiftingTransport,
    WallRepulsion,
)
from jaxsph.scenes import Scene

from ..still_walls import check_still

# what keeps particles evenly spread has nothing to do on fixed points
_OF_PARTICLES = (ParticleShifting, ShiftingTransport, WallRepulsion)
_ROUND_OFF = 1e3  # times the precision: a force that changes by less is steady


def kept_effects(effects: tuple[Effect, ...]) -> tuple[Effect, ...]:
    """All but those that only keep particles evenly spread; viscosity as `IsotropicViscosity`."""
    return tuple(
        IsotropicViscosity(e.viscosity) if isinstance(e, LaminarViscosity) else e
        for e in effects
        if not isinstance(e, _OF_PARTICLES)
    )


def with_effects(functional: SPHFunctional, effects: tuple[Effect, ...]) -> SPHFunctional:
    """The functional of other effects."""
    return eqx.tree_at(
        lambda f: f.effects, functional, effects, is_leaf=lambda x: isinstance(x, tuple)
    )


def with_viscosity(functional: SPHFunctional, viscosity: Float[Array, ""]) -> SPHFunctional:
    """The functional at another viscosity nu [m^2/s]."""
    return with_effects(
        functional,
        tuple(
            IsotropicViscosity(viscosity) if isinstance(e, IsotropicViscosity) else e
            for e in functional.effects
        ),
    )


def check_steady(scene: Scene, points: Float[Array, "points dim"]) -> None:
    """A ValueError if a force changes with time at the points (G, n) [m] during the scene's run, or
    its walls do."""
    check_still(scene)
    force = changing_force(scene, points)
    if force is not None:
        raise ValueError(
            f"effects: {force} changes with time, a constant part does not; use `SampledModel` for "
            "this scene, or start it where the force is steady."
        )


def changing_force(scene: Scene, points: Float[Array, "points dim"]) -> str | None:
    """The name of a force that changes at the points (G, n) [m] during the scene's run, if any.

    It is compared with its start at the times of all snapshots.
    """
    dtype = points.dtype
    times = np.linspace(0.0, scene.end_time, 1 + scene.steps // scene.steps_per_snapshot)
    for force in scene.effects:
        if not isinstance(force, BodyForce):
            continue
        acceleration = eqx.filter_jit(force.acceleration)
        start = acceleration(jnp.asarray(times[0], dtype), points)
        allowed = _ROUND_OFF * jnp.finfo(dtype).eps * jnp.abs(start).max()
        for time in times[1:]:
            later = acceleration(jnp.asarray(time, dtype), points)
            if bool(jnp.abs(later - start).max() > allowed):
                return force.name
    return None
