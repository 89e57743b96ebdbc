"""Hard cases of the consistent scheme: rest and kicks, and what the delta-plus scheme fails at."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import equinox as eqx
import jax

from jaxsph.arrangements import JitteredLattice
from jaxsph.scenes import (
    Scene,
    dam_break,
    hydrostatic_tank,
    lid_driven_cavity,
    piston_wave_maker,
    rotating_square_patch,
    shear_layer,
    standing_wave,
    taylor_green,
)
from jaxsph.schemes import Consistent

from .bounds import (
    CAVITY,
    DECAY,
    DENSITY,
    LAYER,
    PATCH,
    POOL,
    PUSHED,
    SPLASH,
    TANK,
    VORTEX,
    WALLS,
)
from .full_cases import about
from .judge import Case, Run

_KICK = 0.02  # m/s, of U = 1 m/s


def _run(make: Callable[..., Scene], snapshots: int = 40, **settings) -> Run:
    scene = make(**{"dtype": "float64", **settings}, scheme=Consistent())
    return Run(scene, about(scene, snapshots))


def _kicked(resolution: int, end_time: float) -> Run:
    """A closed box of disordered particles with random velocities, under a resting lid."""
    run = _run(
        lid_driven_cavity, resolution=resolution, reynolds=1e6, end_time=end_time,
        arrangement=JitteredLattice(),
    )  # fmt: skip
    velocity = _KICK * jax.random.normal(jax.random.key(0), run.scene.state.velocity.shape)
    resting = eqx.tree_at(lambda s: s.walls.velocity, run.scene, 0.0 * run.scene.walls.velocity)
    return Run(eqx.tree_at(lambda s: s.state.velocity, resting, velocity), run.schedule)


def _case(name, what, bounds, make, slow=False, wrong="", **settings) -> Case:
    precision = settings.get("dtype", "float64")
    run = partial(_run, make, **settings)
    return Case(
        f"consistent/{name}", what, run, bounds, slow=slow, precision=precision, wrong=wrong
    )


_DEEP = (
    "the density of the rolled-up cores, where pressure is lowest, is over its bound; particles do "
    "not clump there"
)


CONSISTENT = (
    Case("consistent/kicked", "closed box of 16 x 16, jittered, Re = 1e6, kicked by 0.02 U, 10 s",
         partial(_kicked, 16, 10.0), (DENSITY, DECAY, WALLS), slow=True),
    _case("tank-re-1e6", "tank of 16 x 16 jittered particles at Re = 1e6, 20 s", TANK,
          hydrostatic_tank, resolution=16, reynolds=1e6, end_time=20.0,
          arrangement=JitteredLattice()),
    _case("cavity-re-5e3", "cavity at Re = 5000, 20 x 20, 4 s", CAVITY,
          lid_driven_cavity, slow=True, resolution=20, reynolds=5e3, end_time=4.0),
    _case("cavity-wide-kernel", "cavity of 24 x 24 with h = 4 dx, Re = 1000, 8 s", CAVITY,
          lid_driven_cavity, slow=True, resolution=24, reynolds=1e3, h_over_dx=4.0,
          end_time=8.0),
    _case("cavity-narrow-kernel", "cavity of 32 x 32 with h = 1.5 dx, Re = 1000, 8 s", CAVITY,
          lid_driven_cavity, slow=True, resolution=32, reynolds=1e3, h_over_dx=1.5, end_time=8.0),
    _case("cavity-float32-long", "as cavity/float32-long", CAVITY,
          lid_driven_cavity, slow=True, resolution=50, reynolds=5e3, end_time=20.0,
          dtype="float32"),
    _case("vortex-jittered-re-1e6", "as taylor-green/from-jittered-re-1e6", VORTEX,
          taylor_green, slow=True, resolution=64, reynolds=1e6, end_time=10.0,
          arrangement=JitteredLattice()),
    _case("thin-layer-long", "as shear-layer/thin-long", LAYER,
          shear_layer, slow=True, wrong=_DEEP, resolution=128, reynolds=1e6, end_time=2.0,
          thickness=1.0 / 80.0),
    _case("thin-layer-long-evened", "as shear-layer/thin-long-evened", LAYER,
          shear_layer, slow=True, wrong=_DEEP, resolution=128, reynolds=1e6, end_time=2.0,
          thickness=1.0 / 80.0,
          background_pressure=4000.0),
    _case("thin-layer-long-stiff", "as shear-layer/thin-long-stiff", LAYER,
          shear_layer, slow=True, resolution=128, reynolds=1e6, end_time=2.0,
          thickness=1.0 / 80.0, background_pressure=4000.0, mach=0.05, time_step=6.25e-4),
    _case("dam-break-corner", "a = 8 dx, into the corner and back", SPLASH,
          dam_break, resolution=40, end_time=0.5),
    *(
        _case(f"dam-break-{along}-to-rest", f"{along} particles along the tank, 8 s", SPLASH,
              dam_break, slow=True, resolution=along, end_time=8.0)
        for along in (30, 40, 50, 70)
    ),
    _case("standing-wave", "32 dx long, 3 s", POOL, standing_wave, resolution=32, end_time=3.0),
    _case("standing-wave-long", "40 dx long, 12 s", POOL, standing_wave, slow=True, resolution=40,
          end_time=12.0),
    _case("piston", "2 periods of a piston wave maker, water 7 dx deep", PUSHED,
          piston_wave_maker, slow=True, resolution=80, end_time=2.4),
    _case("patch", "50 dx wide, omega t = 4", PATCH, rotating_square_patch, slow=True,
          resolution=50, end_time=4.0),
)  # fmt: skip
