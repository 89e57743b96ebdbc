"""Hard cases of the full model: long runs, single precision, walls, and time steps at the limit."""

from __future__ import annotations

import dataclasses
from functools import partial

from jaxsph import Schedule
from jaxsph.arrangements import Arrangement, JitteredLattice, Lattice, Packed
from jaxsph.effects import ArtificialViscosity, BackgroundPressure, Effect
from jaxsph.integrate import FaultCode
from jaxsph.scenes import (
    Scene,
    hydrostatic_tank,
    lid_driven_cavity,
    open_cavity,
    taylor_green,
)
from jaxsph.schemes import DeltaPlus

from .bounds import CAVITY, CHANNEL, TANK, VORTEX
from .judge import Case, Ending, Run

_SOUND_SPEED = 10.0  # m/s, of all scenes here at Ma = 0.1 and U = 1 m/s
_STEP_TOO_LONG = (
    FaultCode.NOT_FINITE,
    FaultCode.DENSITY_OUT_OF_BOUNDS,
    FaultCode.NEIGHBORS_OUTDATED,
    FaultCode.BEYOND_WALL,
)


def _vortex(
    resolution: int, reynolds: float, end_time: float, arrangement: Arrangement, precision: str
) -> Run:
    scene = taylor_green(
        resolution, reynolds, end_time=end_time, arrangement=arrangement, scheme=DeltaPlus(),
        dtype=precision,
    )
    return Run(scene, about(scene, 50))


def _evened(resolution: int, reynolds: float, end_time: float, arrangement: Arrangement) -> Run:
    """A vortex under a background pressure of 4 rho0 U^2, which keeps pressures positive."""
    run = _vortex(resolution, reynolds, end_time, arrangement, "float64")
    return _with_effect(run, BackgroundPressure(4.0 * run.scene.fluid.reference_density))


def _with_effect(run: Run, effect: Effect) -> Run:
    scene = run.scene
    return dataclasses.replace(
        run, scene=dataclasses.replace(scene, effects=(*scene.effects, effect))
    )


def _cavity(resolution: int, reynolds: float, end_time: float, precision: str) -> Run:
    scene = lid_driven_cavity(
        resolution, reynolds, end_time=end_time, scheme=DeltaPlus(), dtype=precision
    )
    return Run(scene, about(scene, 50))


def _damped_cavity(resolution: int, reynolds: float, end_time: float, precision: str) -> Run:
    """A cavity with artificial viscosity, alpha = 0.01."""
    run = _cavity(resolution, reynolds, end_time, precision)
    return _with_effect(run, ArtificialViscosity(0.01))


def _tank(resolution: int, end_time: float, precision: str) -> Run:
    scene = hydrostatic_tank(
        resolution, end_time=end_time, scheme=DeltaPlus(), dtype=precision
    )
    return Run(scene, about(scene, 50))


def _open_cavity(resolution: int, end_time: float) -> Run:
    scene = open_cavity(resolution, end_time=end_time, scheme=DeltaPlus(), dtype="float64")
    return Run(scene, about(scene, 200))


def about(scene: Scene, snapshots: int) -> Schedule:
    """The scene's steps with about so many snapshots."""
    return every(scene, max(1, scene.steps // snapshots))


def every(scene: Scene, steps: int) -> Schedule:
    """The scene's steps, rounded up to whole intervals of so many."""
    return Schedule(scene.time_step, steps, -(-scene.steps // steps))


def _courant_vortex(courant: float) -> Run:
    """A vortex whose scene is built with the step C h / c0."""
    scene = taylor_green(
        24, end_time=1.0, time_step=_step(2.0 / 24, courant), scheme=DeltaPlus(), dtype="float64"
    )
    return Run(scene, every(scene, 10))


def _driven_beyond(scene: Scene, courant: float) -> Run:
    """A good scene driven by `simulate` with the step C h / c0, for 1 s."""
    step = _step(scene.space.smoothing_length, courant)
    return Run(scene, Schedule(step, 2, -(-round(1.0 / step) // 2)))


def _step(smoothing_length: float, courant: float) -> float:
    return courant * smoothing_length / _SOUND_SPEED


def _beyond_vortex(courant: float) -> Run:
    return _driven_beyond(taylor_green(24, scheme=DeltaPlus(), dtype="float64"), courant)


def _beyond_cavity(courant: float) -> Run:
    return _driven_beyond(lid_driven_cavity(16, scheme=DeltaPlus(), dtype="float64"), courant)


def _vortex_case(
    name: str, what: str, resolution=24, reynolds=100.0, end_time=2.0, arrangement=None,
    precision="float64", slow=False, wrong="",
) -> Case:  # fmt: skip
    arrangement = Packed() if arrangement is None else arrangement
    make = partial(_vortex, resolution, reynolds, end_time, arrangement, precision)
    return Case(
        f"taylor-green/{name}", what, make, VORTEX, slow=slow, precision=precision, wrong=wrong
    )


def _cavity_case(
    name, what, resolution, reynolds, end_time, precision="float64", slow=False, wrong="",
    make=_cavity,
) -> Case:  # fmt: skip
    make = partial(make, resolution, reynolds, end_time, precision)
    return Case(f"cavity/{name}", what, make, CAVITY, slow=slow, precision=precision, wrong=wrong)


def _tank_case(name, what, resolution, end_time, precision="float64", slow=False):
    make = partial(_tank, resolution, end_time, precision)
    return Case(f"tank/{name}", what, make, TANK, slow=slow, precision=precision)


_RE = ((1e3, "1e3"), (1e4, "1e4"), (1e6, "1e6"))
_ARRANGEMENTS = (("lattice", Lattice()), ("packed", Packed()), ("jittered", JitteredLattice()))

_STICKS = (
    "where the pressure is negative single pairs of particles come nearer than 0.2 dx; a "
    "background pressure prevents it, as taylor-green/from-jittered-re-1e6-evened shows"
)

_COLLIDES = (
    "a spacing is a hundred times nu / U: in the corner that the lid blows into, single particles "
    "collide, and the density of one is over the bound for an instant; artificial viscosity "
    "prevents it, as cavity/float32-long-damped shows"
)

LONG = (
    *(_vortex_case(f"re-{n}", f"Re = {n}, 32 x 32, 5 s: several turns after the laminar time",
                   32, re, 5.0, slow=re < 1e6) for re, n in _RE),
    *(_vortex_case(f"re-{n}-long", f"Re = {n}, 100 x 100, 20 s", 100, re, 20.0, slow=True)
      for re, n in _RE),
    *(_vortex_case(f"from-{n}", f"started on the {n} arrangement, 24 x 24, 2 s", arrangement=a,
                   slow=True) for n, a in _ARRANGEMENTS),
    *(_vortex_case(f"from-{n}-re-1e6", f"Re = 1e6 from the {n} arrangement, 64 x 64, 10 s",
                   64, 1e6, 10.0, a, slow=True, wrong=_STICKS if n == "jittered" else "")
      for n, a in _ARRANGEMENTS),
    Case("taylor-green/from-jittered-re-1e6-evened", "the same under a background pressure",
         partial(_evened, 64, 1e6, 10.0, JitteredLattice()), VORTEX, slow=True),
    _vortex_case("float32", "single precision, Re = 1e4, 24 x 24, 3 s",
                 24, 1e4, 3.0, precision="float32"),
    _vortex_case("float32-long", "single precision, Re = 1e6, 100 x 100, 20 s",
                 100, 1e6, 20.0, precision="float32", slow=True),
)  # fmt: skip

WALLED = (
    _cavity_case("re-1e3", "Re = 1000, 20 x 20, 4 s from rest", 20, 1e3, 4.0, slow=True),
    _cavity_case("re-5e3", "Re = 5000, 20 x 20, 4 s from rest", 20, 5e3, 4.0),
    _cavity_case("float32", "single precision, Re = 1000, 20 x 20, 2 s", 20, 1e3, 2.0, "float32",
                 slow=True),
    _cavity_case("re-1e3-long", "Re = 1000, 50 x 50, 20 s", 50, 1e3, 20.0, slow=True),
    _cavity_case("re-5e3-long", "Re = 5000, 50 x 50, 20 s", 50, 5e3, 20.0, slow=True),
    _cavity_case("float32-long", "single precision, Re = 5000, 50 x 50, 20 s",
                 50, 5e3, 20.0, "float32", slow=True, wrong=_COLLIDES),
    _cavity_case("float32-long-damped", "the same with artificial viscosity, alpha = 0.01",
                 50, 5e3, 20.0, "float32", slow=True, make=_damped_cavity),
    _tank_case("rest", "20 x 20, 5 s at rest under gravity", 20, 5.0),
    _tank_case("float32", "single precision, 20 x 20, 5 s at rest", 20, 5.0, "float32", slow=True),
    _tank_case("rest-long", "50 x 50, 100 s at rest under gravity", 50, 100.0, slow=True),
    _tank_case("float32-long", "single precision, 50 x 50, 100 s", 50, 100.0, "float32", slow=True),
    Case("open-cavity/shedding-long", "dx = 5 mm, 12 s: some 17 periods of shedding",
         partial(_open_cavity, 80, 12.0), CHANNEL, slow=True),
)  # fmt: skip

STEPS = (
    *(Case(f"step/{c:g}-h-over-c0", f"a vortex with dt = {c:g} h / c0; 1.5 is the limit",
           partial(_courant_vortex, c), VORTEX, slow=c == 0.5) for c in (0.5, 1.0, 1.5)),
    *(Case(f"step/{c:g}-h-over-c0-scene", f"a scene built with dt = {c:g} h / c0, over the limit",
           partial(_courant_vortex, c), endings=(Ending.REFUSED,),
           says="time step: .* is beyond the stability limit of .* choose one below it")
      for c in (1.6, 2.0, 3.0)),
    *(Case(f"step/{c:g}-h-over-c0-{n}", f"a {n} driven with dt = {c:g} h / c0, over the limit",
           partial(make, c), endings=(Ending.FAULT,), says="smaller time step",
           codes=_STEP_TOO_LONG)
      for c, n, make in ((2.0, "vortex", _beyond_vortex), (3.0, "vortex", _beyond_vortex),
                         (3.0, "cavity", _beyond_cavity), (4.0, "cavity", _beyond_cavity))),
)  # fmt: skip

FULL = (*LONG, *WALLED, *STEPS)
