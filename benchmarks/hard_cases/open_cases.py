"""Hard cases of flows that come in at one end and go out at the other."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp

from jaxsph import BallRegion, WallPart
from jaxsph.effects import Fringe, ParabolicProfile, Varying
from jaxsph.integrate import FaultCode
from jaxsph.parking import flowing
from jaxsph.scenes import (
    FringeEnds,
    Scale,
    Scene,
    channel_cylinder,
    cylinder,
    filling_tank,
    floating_box,
    poiseuille_open,
)
from jaxsph.scenes.open_channel import open_channel
from jaxsph.scenes.poiseuille_open import LENGTH
from jaxsph.schemes import SharpAtWalls

from .bounds import LEAVING, PULSED, STOPPED, STRUCK, THROUGH
from .full_cases import about
from .judge import Case, Ending, Run


def _channel(factor: Callable, end_time: float, precision: str, ends: str = "fringe") -> Run:
    scene = poiseuille_open(12, ends=ends, h_over_dx=1.5, end_time=end_time, dtype=precision)
    return Run(_varying(scene, factor), about(scene, 40))


def _varying(scene: Scene, factor: Callable) -> Scene:
    """The scene with an inflow of another strength, its last effect's."""
    *others, last = scene.effects
    if isinstance(last, Fringe):
        last = dataclasses.replace(last, profile=Varying(last.profile, factor))
    else:
        inlet, *rest = last.openings
        inlet = dataclasses.replace(inlet, velocity=Varying(inlet.velocity, factor))
        last = dataclasses.replace(last, openings=(inlet, *rest))
    return dataclasses.replace(scene, effects=(*others, last))


def _cylinder(resolution: int, reynolds: float, end_time: float) -> Run:
    scene = channel_cylinder(resolution, reynolds, end_time=end_time, dtype="float64")
    return Run(scene, about(scene, 40))


def _vortex_leaves(end_time: float, ends: str = "fringe") -> Run:
    """One of twice the inflow's speed, half a radius ahead of the outlet: part of it turns back."""
    scene = poiseuille_open(
        16, 1000.0, ends=ends, h_over_dx=1.5, end_time=end_time, dtype="float64"
    )
    position = scene.state.position
    apart = (position - jnp.asarray([[LENGTH - 0.1, 0.5]])) / 0.2
    turn = jnp.exp(0.5 - 0.5 * jnp.sum(apart**2, axis=1))[:, None]
    around = jnp.stack([-apart[:, 1], apart[:, 0]], axis=1) * turn
    inflow = ParabolicProfile(jnp.ones(()), 1.0)(position, jnp.zeros(()))
    if scene.parking is not None:
        inflow = jnp.where(scene.parking.holds(position)[:, None], 0.0, inflow)
    velocity = inflow + 2.0 * around
    state = dataclasses.replace(scene.state, velocity=velocity)
    return Run(dataclasses.replace(scene, state=state), about(scene, 40))


def _near_a_wall(gap: float, end_time: float) -> Run:
    """A cylinder of 8 particles a diameter, so many of them off the wall of a channel."""
    body, across = BallRegion((1.5, 0.5 + gap / 8.0), 0.5), 24
    scene = open_channel(
        "near-a-wall",
        length=4.0,
        ends=FringeEnds(1.5),
        height=3.0,
        mean_speed=2.0 / 3.0,
        obstacle=body,
        parts=[WallPart("cylinder", body)],
        scale=Scale(across, 1.5, 1.25e-2, 20),
        end_time=end_time,
        viscosity=0.02,
        mach=0.1,
        layers=None,
        arrangement=None,
        kernel=None,
        scheme=SharpAtWalls(),
        dtype="float64",
        parameters={},
    )
    return Run(scene, about(scene, 40))


def _in_a_stream(
    reynolds: float,
    end_time: float,
    precision: str,
    factor: Callable | None = None,
    time_step: float | None = None,
) -> Run:
    """A cylinder, 8 particles a diameter, four diameters to the next."""
    scene = cylinder(
        8, reynolds, upstream=2.0, downstream=3.0, width=4.0, end_time=end_time,
        time_step=time_step, dtype=precision,
    )  # fmt: skip
    return Run(scene if factor is None else _varying(scene, factor), about(scene, 40))


def _nothing() -> Run:
    """A tank with no water in it, nor behind its port."""
    scene = filling_tank(20, end_time=1.0, dtype="float64")
    place = jnp.tile(jnp.asarray(scene.parking.place), (len(scene.state.density), 1))
    state = dataclasses.replace(scene.state, position=place)
    return Run(dataclasses.replace(scene, state=state), about(scene, 20))


def _filling(end_time: float, parked: int, factor: Callable | None = None) -> Run:
    """A tank 20 particles wide, with so many parked."""
    scene = filling_tank(20, end_time=end_time, dtype="float64")
    moving = len(flowing(scene.state.position, scene.parking))
    state = jax.tree.map(lambda a: a[: moving + parked], scene.state)
    scene = dataclasses.replace(scene, state=state)
    return Run(scene if factor is None else _varying(scene, factor), about(scene, 20))


def _sinking(end_time: float) -> Run:
    scene = floating_box(density=4000.0, end_time=end_time, dtype="float64")
    return Run(scene, about(scene, 40))


def _steady(time):
    return jnp.ones_like(time)


def _stops(time):
    """From 1 to 0 between 0.5 s and 1 s."""
    way = jnp.clip(2.0 * time - 1.0, 0.0, 1.0)
    return 1.0 - way * way * (3.0 - 2.0 * way)


def _drains(time):
    return -jnp.ones_like(time)


def _swings(time):
    return jnp.cos(jnp.pi * time)


def _turns(time):
    """Within 4 s."""
    return jnp.cos(0.25 * jnp.pi * time)


# what a body that nears a wall ends in: the contact, or the water between the two
_PRESSED_OUT = (FaultCode.BODY_MET_WALL, FaultCode.BEYOND_WALL, FaultCode.NEIGHBORS_OUTDATED)

OPEN = (
    Case("open/inflow-stops", "12 across, Re = 10, the inflow stops within 0.5 s, 3 s",
         partial(_channel, _stops, 3.0, "float64"), STOPPED),
    Case("open/back-flow", "the same, the inflow swings: half of the time in at the outlet",
         partial(_channel, _swings, 3.0, "float64"), PULSED, slow=True),
    Case("open/float32", "single precision, 12 across, a plug becomes the profile, 3 s",
         partial(_channel, _steady, 3.0, "float32"), PULSED, precision="float32", slow=True),
    Case("open/back-flow-float32", "single precision, the inflow swings",
         partial(_channel, _swings, 3.0, "float32"), PULSED, precision="float32"),
    Case("open/buffers-inflow-stops", "through openings, the inflow stops within 0.5 s, 3 s",
         partial(_channel, _stops, 3.0, "float64", "openings"), STOPPED),
    Case("open/buffers-back-flow", "through openings, the inflow swings: half of the time out",
         partial(_channel, _swings, 3.0, "float64", "openings"), THROUGH, slow=True),
    Case("open/buffers-float32", "the same in single precision",
         partial(_channel, _swings, 3.0, "float32", "openings"), THROUGH, precision="float32"),
    Case("open/none-parked", "a tank that fills, four particles parked and more coming in",
         partial(_filling, 1.6, 4), endings=(Ending.FAULT,), says="park more of them",
         codes=(FaultCode.NONE_PARKED,)),
    Case("open/all-parked", "a tank with no water in it, nor behind its port, all of it parked",
         _nothing, endings=(Ending.REFUSED,), says="no particle is in the buffer of the inlet"),
    Case("open/buffers-vortex-leaves", "16 across, Re = 1000, a vortex leaves through an opening",
         partial(_vortex_leaves, 3.0, "openings"), LEAVING, slow=True),
    Case("open/tank-drains", "the tank's inflow turned round: it drains to the port's top, 6 s",
         partial(_filling, 6.0, 0, _drains), STRUCK, slow=True),
    Case("open/impulsive-start", "a cylinder, 6 particles a diameter, Re = 20, set going at once",
         partial(_cylinder, 25, 20.0, 0.5), STRUCK, slow=True),
    Case("open/vortex-leaves", "16 across, Re = 1000, twice the inflow's speed in it, 3 s",
         partial(_vortex_leaves, 3.0), STRUCK, slow=True),
    Case("open/near-a-wall", "a cylinder, 8 particles a diameter, half of one off the wall, 2 s",
         partial(_near_a_wall, 4.0, 2.0), STRUCK, slow=True),
    Case("open/at-a-wall", "the same, one particle off the wall",
         partial(_near_a_wall, 1.0, 2.0), STRUCK, slow=True),
    Case("open/re-1000", "a cylinder, 8 particles a diameter, Re = 1000, 6 s from an abrupt start",
         partial(_in_a_stream, 1000.0, 6.0, "float64"), STRUCK, slow=True),
    Case("open/cylinder-float32", "single precision, Re = 100, 3 s",
         partial(_in_a_stream, 100.0, 3.0, "float32"), STRUCK, precision="float32", slow=True),
    Case("open/stream-turns",
         "a cylinder at Re = 100, the stream turns round within 4 s, 5 s at half the scene's step",
         partial(_in_a_stream, 100.0, 5.0, "float64", _turns, 0.01), STRUCK, slow=True),
    Case("open/stream-turns-own-step", "the same at the scene's own step, 0.67 of 1.5 h / c0",
         partial(_in_a_stream, 100.0, 5.0, "float64", _turns), STRUCK,
         (Ending.FINISHED, Ending.FAULT), codes=(FaultCode.DENSITY_OUT_OF_BOUNDS,), slow=True),
    Case("open/stream-turns-fast", "the same within 1 s: w U L / 2 c0^2 is 0.13 of the density",
         partial(_in_a_stream, 100.0, 3.0, "float64", _swings), STRUCK,
         (Ending.FINISHED, Ending.FAULT), codes=(FaultCode.DENSITY_OUT_OF_BOUNDS,), slow=True),
    Case("open/step-0.80", "a cylinder at Re = 40 set going at once, dt = 0.80 of 1.5 h / c0, 5 s",
         partial(_in_a_stream, 40.0, 5.4, "float64", None, 0.0225), STRUCK, slow=True),
    Case("open/step-0.96", "the same, dt = 0.96 of it",
         partial(_in_a_stream, 40.0, 5.4, "float64", None, 0.027), STRUCK,
         (Ending.FINISHED, Ending.FAULT), codes=(FaultCode.NEIGHBORS_OUTDATED,), slow=True),
    Case("open/body-sinks", "a box four times as heavy as water sinks to the floor",
         partial(_sinking, 1.5), endings=(Ending.FAULT,), says="free body",
         codes=_PRESSED_OUT, slow=True),
)  # fmt: skip
