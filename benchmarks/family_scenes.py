"""Families of scenes that reduced models are judged by (`benchmarks.families`)."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsph import Box, ParticleState
from jaxsph.arrangements import Lattice
from jaxsph.effects import BodyForce, Effect
from jaxsph.scenes import Scale, Scene, enclosed_flow, lid_driven_cavity, poiseuille, taylor_green
from jaxsph.schemes import Consistent
from jaxsph.walls import BoxRegion
from jaxsph_rom import LinearClosure


class Stirring(BodyForce):
    """b = A (sin(pi x) cos(pi y), -cos(pi x) sin(pi y)): it turns the water of a vessel."""

    amplitude: Float[Array, ""] = eqx.field(converter=jnp.asarray)

    def acceleration(self, time, position):
        x, y = jnp.pi * position[:, 0], jnp.pi * position[:, 1]
        turn = jnp.stack([jnp.sin(x) * jnp.cos(y), -jnp.cos(x) * jnp.sin(y)], axis=1)
        return self.amplitude * turn


def vessel(viscosity: float, force: float, *, resolution: int, end_time: float) -> Scene:
    """A square vessel whose water is stirred from rest."""
    return enclosed_flow(
        "stirred-vessel",
        box=Box((0.0, 0.0), (1.0, 1.0), (False, False)),
        fluid_region=BoxRegion((0.0, 0.0), (1.0, 1.0)),
        force=Stirring(force),
        scale=Scale(resolution, 2.0, 0.1 / resolution, 10),
        end_time=end_time,
        reference_density=1.0,
        reference_speed=1.0,
        mach=0.1,
        viscosity=viscosity,
        scheme=Consistent(),
        parameters={},
    )


def cavity(reynolds: float, lid: float, *, resolution: int, end_time: float) -> Scene:
    """The lid-driven cavity at a speed of its lid [m/s]; Re is that of this speed."""
    scene = lid_driven_cavity(
        resolution, reynolds, time_step=0.1 / resolution, end_time=end_time
    )
    effects = [with_viscosity(effect, lid / reynolds) for effect in scene.effects]
    walls = dataclasses.replace(scene.walls, velocity=lid * scene.walls.velocity)
    return dataclasses.replace(scene, effects=tuple(effects), walls=walls)


def vortex(reynolds: float, amplitude: float, *, resolution: int, end_time: float) -> Scene:
    """The Taylor-Green vortex of a speed at the start [m/s]."""
    scene = taylor_green(
        resolution, reynolds, time_step=0.1 / resolution, end_time=end_time,
        arrangement=Lattice(), scheme=Consistent(),
    )  # fmt: skip
    state, rest = scene.state, scene.fluid.reference_density
    density = rest + amplitude**2 * (state.density - rest)
    start = ParticleState(state.position, amplitude * state.velocity, density)
    return dataclasses.replace(scene, state=start)


def channel(reynolds: float, *, resolution: int, end_time: float) -> Scene:
    """Poiseuille flow from rest, whose force is 8 / Re."""
    return poiseuille(
        resolution, reynolds, h_over_dx=1.5, time_step=0.1 / resolution, end_time=end_time
    )


def with_viscosity(effect: Effect, viscosity: float) -> Effect:
    """An effect with another viscosity, if it has one."""
    if "viscosity" not in {field.name for field in dataclasses.fields(effect)}:
        return effect
    return dataclasses.replace(effect, viscosity=jnp.full_like(effect.viscosity, viscosity))


class Case(NamedTuple):
    """A family, its training points, how many modes its model has, and its closure."""

    told: str
    make: Callable[..., Scene]
    points: list[dict[str, float]]
    modes: int
    closure: LinearClosure | None = None


def _corners(**ranges: tuple[float, float]) -> list[dict[str, float]]:
    """The corners of a box of parameters, and its middle."""
    (a, (low, high)), (b, (under, over)) = ranges.items()
    corners = [{a: x, b: y} for x in (low, high) for y in (under, over)]
    return [*corners, {a: 0.5 * (low + high), b: 0.5 * (under + over)}]


CASES = {
    "vessel": Case(
        "water stirred from rest in a square vessel, over viscosity and force",
        vessel, _corners(viscosity=(0.01, 0.03), force=(0.5, 1.5)), 10, LinearClosure(),
    ),
    "cavity": Case(
        "the lid-driven cavity from rest, over Reynolds number and lid speed",
        cavity, _corners(reynolds=(50.0, 150.0), lid=(0.5, 1.0)), 10, LinearClosure(),
    ),
    "vortex": Case(
        "the Taylor-Green vortex, over Reynolds number and amplitude of the start",
        vortex, _corners(reynolds=(50.0, 150.0), amplitude=(0.5, 1.0)), 6,
    ),
    "channel": Case(
        "Poiseuille flow from rest, over the Reynolds number; its force is 8 / Re",
        channel, [{"reynolds": re} for re in (20.0, 40.0, 80.0)], 6, LinearClosure(),
    ),
}  # fmt: skip
