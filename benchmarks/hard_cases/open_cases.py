"""Hard cases of flows that come in at one end and go out at the other."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial

import jax.numpy as jnp

from jaxsph.effects import Fringe, Varying
from jaxsph.scenes import Scene, channel_cylinder, poiseuille_open

from .bounds import PULSED, STOPPED, STRUCK
from .full_cases import about
from .judge import Case, Run


def _channel(factor: Callable, end_time: float, precision: str) -> Run:
    scene = poiseuille_open(12, h_over_dx=1.5, end_time=end_time, dtype=precision)
    return Run(_varying(scene, factor), about(scene, 40))


def _varying(scene: Scene, factor: Callable) -> Scene:
    effects = tuple(
        dataclasses.replace(effect, profile=Varying(effect.profile, factor))
        if isinstance(effect, Fringe)
        else effect
        for effect in scene.effects
    )
    return dataclasses.replace(scene, effects=effects)


def _cylinder(resolution: int, reynolds: float, end_time: float) -> Run:
    scene = channel_cylinder(resolution, reynolds, end_time=end_time, dtype="float64")
    return Run(scene, about(scene, 40))


def _steady(time):
    return jnp.ones_like(time)


def _stops(time):
    """From 1 to 0 between 0.5 s and 1 s."""
    way = jnp.clip(2.0 * time - 1.0, 0.0, 1.0)
    return 1.0 - way * way * (3.0 - 2.0 * way)


def _swings(time):
    return jnp.cos(jnp.pi * time)


OPEN = (
    Case("open/inflow-stops", "12 across, Re = 10, the inflow stops within 0.5 s, 3 s",
         partial(_channel, _stops, 3.0, "float64"), STOPPED),
    Case("open/back-flow", "the same, the inflow swings: half of the time in at the outlet",
         partial(_channel, _swings, 3.0, "float64"), PULSED),
    Case("open/float32", "single precision, 12 across, a plug becomes the profile, 3 s",
         partial(_channel, _steady, 3.0, "float32"), PULSED, precision="float32"),
    Case("open/back-flow-float32", "single precision, the inflow swings",
         partial(_channel, _swings, 3.0, "float32"), PULSED, precision="float32"),
    Case("open/impulsive-start", "a cylinder, 6 particles a diameter, Re = 20, set going at once",
         partial(_cylinder, 25, 20.0, 0.5), STRUCK, slow=True),
)  # fmt: skip
