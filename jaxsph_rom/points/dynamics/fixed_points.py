"""What of a scene acts at points that do not move."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsph import ParticleState, SPHFunctional
from jaxsph.effects import Effect
from jaxsph.scenes import Scene

from ...still_walls import check_still
from .point_lists import neighbors_at

_ROUND_OFF = 1e5  # times the precision: what changes by less is steady, or linear
_SEED = 0
_BEND = 0.1  # of the density: where a bent equation of state shows
_TIMES, _GOLDEN = 13, 0.6180339887498949


def kept_effects(effects: tuple[Effect, ...]) -> tuple[Effect, ...]:
    """What each effect is on fixed points, none of these twice.

    Raises:
        ValueError: if one has no meaning there.
    """
    kept: list[Effect] = []
    for form in (form for effect in effects for form in effect.on_fixed_points()):
        if not any(bool(eqx.tree_equal(form, other)) for other in kept):
            kept.append(form)
    return tuple(kept)


def with_effects(functional: SPHFunctional, effects: tuple[Effect, ...]) -> SPHFunctional:
    """The functional of other effects."""
    return eqx.tree_at(
        lambda f: f.effects, functional, effects, is_leaf=lambda x: isinstance(x, tuple)
    )


def on_points(scene: Scene) -> SPHFunctional:
    """The functional of a scene on fixed points, all its numbers arrays.

    Raises:
        ValueError: if bodies are moved through the fluid, or an effect has no meaning there.
    """
    check_still(scene)
    dtype = scene.state.position.dtype
    functional = with_effects(scene.functional(), kept_effects(scene.effects))
    return jax.tree.map(
        lambda a: jnp.asarray(a, dtype) if isinstance(a, float) else a, functional
    )


def check_quadratic(scene: Scene, functional: SPHFunctional, points, neighbors) -> None:
    """A ValueError if an effect changes with time or is not linear in the velocity, or the
    fluid's pressure is not linear in its density.

    Each effect's own rates at a random state are compared with those at other times of the scene's
    run, and with those of twice the velocity.

    Args:
        scene: its state gives the scales, its steps the times.
        functional: on the points.
        points: (G, n) [m].
        neighbors: list of the points.
    """
    dtype, fluid = points.dtype, functional.fluid
    ratio = np.asarray([1.0 - _BEND, 1.0, 1.0 + _BEND])
    bent = jnp.asarray(ratio * float(fluid.reference_density), dtype)
    low, middle, high = np.asarray(fluid.pressure(bent))
    if abs(low + high - 2.0 * middle) > 1e-3 * _BEND * abs(high - low):
        raise ValueError(
            f"fluid: {type(fluid.equation_of_state).__name__} is not linear in the density, and "
            "constant tensors hold no more; use reduction=Samples() for this scene."
        )
    draw = np.random.default_rng(_SEED).uniform(-1.0, 1.0, points.shape)
    velocity = float(fluid.reference_speed) * draw
    density = jnp.asarray(np.full(len(points), float(fluid.reference_density)), dtype)
    parts = eqx.filter_jit(_rates_by_effect)

    def at(time, factor):
        state = ParticleState(points, jnp.asarray(factor * velocity, dtype), density)
        found = parts(functional, jnp.asarray(time, dtype), state, neighbors)
        return jax.tree.map(np.asarray, found)

    rest, once, twice = (at(0.0, factor) for factor in (0.0, 1.0, 2.0))
    for effect, (a, b, c) in zip(
        functional.effects, zip(rest, once, twice, strict=True), strict=True
    ):
        if _differ(jax.tree.map(lambda x, z: 0.5 * (x + z), a, c), b, (a, b, c)):
            raise ValueError(
                f"effects: {effect.name} is not linear in the velocity, and constant tensors hold "
                "no more; use reduction=Samples() for this scene."
            )
    # at no even intervals, which a force may share
    for time in scene.end_time * np.modf(_GOLDEN * np.arange(1, _TIMES))[0]:
        for effect, a, b in zip(functional.effects, once, at(time, 1.0), strict=True):
            if _differ(a, b, (once[0], a, b)):
                raise ValueError(
                    f"effects: {effect.name} changes with time, a constant part does not; use "
                    "reduction=Samples() for this scene, or start it where the force is steady."
                )


def _rates_by_effect(functional: SPHFunctional, time, state, neighbors) -> list[dict[str, Array]]:
    """Rates of velocity and density by each effect, and what it makes of those of all, in the
    list's order."""
    context, fields, sums = functional.sums(time, state, neighbors)
    none, one = (_uniform(fields, value) for value in (0.0, 1.0))
    found = []
    for effect in functional.effects:
        rates = effect.rates(context, fields, sums)
        of_none, of_one = (effect.governed(context, fields, rate) for rate in (none, one))
        found.append(
            {name: rate for name, rate in rates.items() if name != "position"}
            | {f"of none, {name}": rate for name, rate in of_none.items()}
            | {f"of one, {name}": rate for name, rate in of_one.items()}
        )
    return found


def _uniform(fields: dict[str, Array], value: float) -> dict[str, Array]:
    return {name: jnp.full_like(fields[name], value) for name in ("velocity", "density")}


def _differ(mine, theirs, scale) -> bool:
    """Whether rates differ by more than round-off of what they are made of."""
    for name, value in mine.items():
        largest = max(float(np.abs(part[name]).max()) for part in scale if name in part)
        allowed = _ROUND_OFF * np.finfo(value.dtype).eps * largest
        if not np.abs(value - theirs[name]).max() <= allowed:
            return True
    return False


def check_steady(scene: Scene, points: Float[Array, "points dim"]) -> None:
    """A ValueError if tensors cannot hold a scene; see `check_quadratic`."""
    points = jnp.asarray(points, scene.state.position.dtype)
    functional = on_points(scene)
    check_quadratic(scene, functional, points, neighbors_at(functional, points))
