"""Hard cases with free surfaces, under tension, and of thin shear layers."""

from __future__ import annotations

from functools import partial

from jaxsph.scenes import (
    dam_break,
    gresho_vortex,
    oscillating_drop,
    piston_wave_maker,
    rotating_square_patch,
    shear_layer,
    standing_wave,
)
from jaxsph.schemes import DeltaPlus

from .bounds import LAYER, PATCH, POOL, PUSHED, SPLASH, TENSION_DROP, UNRESOLVED
from .full_cases import about
from .judge import Case, Run


def _run(make, resolution: int, end_time: float, **more) -> Run:
    if make is not oscillating_drop:
        more = {"scheme": DeltaPlus(), **more}
    scene = make(resolution, end_time=end_time, dtype="float64", **more)
    return Run(scene, about(scene, 40))


def _case(name, what, bounds, make, resolution, end_time, slow=False, wrong="", **more) -> Case:
    run = partial(_run, make, resolution, end_time, **more)
    return Case(name, what, run, bounds, slow=slow, wrong=wrong)


_THIN = 1.0 / 80.0  # m
_CLUMPS = (
    "in the rolled-up cores the pressure is negative and particles clump; a background pressure "
    "prevents that, as shear-layer/thin-long-evened shows"
)
_DEEP = (
    "the cores' low pressure expands the fluid by more than the bound on density; at half the Mach "
    "number it does not, as shear-layer/thin-long-stiff shows"
)

FREE = (
    _case("dam-break/impact", "a = 10 dx, to t (2 g / a)^1/2 = 5.9, past the impact",
          SPLASH, dam_break, 50, 0.32),
    _case("dam-break/impact-long", "a = 30 dx, the same", SPLASH, dam_break, 150, 0.32, slow=True),
    _case("piston/waves", "2 periods of a piston wave maker, water 7 dx deep",
          PUSHED, piston_wave_maker, 80, 2.4),
    _case("patch/turn", "16 dx wide, omega t = 2: tension in the middle, arms grow",
          PATCH, rotating_square_patch, 16, 2.0),
    _case("patch/turn-long", "50 dx wide, omega t = 4", PATCH, rotating_square_patch, 50, 4.0,
          slow=True),
    _case("shear-layer/rolls-up", "layers of 1/30 m, 1.6 dx, on 48 x 48, Re = 1e4, 1 s",
          LAYER, shear_layer, 48, 1.0, slow=True),
    _case("shear-layer/unresolved", "layers of 1/80 m, 0.4 dx, on 32 x 32, Re = 1e4, 1 s",
          UNRESOLVED, shear_layer, 32, 1.0, thickness=_THIN),
    _case("shear-layer/thin-long", "layers of 1/80 m on 128 x 128, Re = 1e6, 2 s",
          LAYER, shear_layer, 128, 2.0, thickness=_THIN, reynolds=1e6, slow=True, wrong=_CLUMPS),
    _case("shear-layer/thin-long-evened", "the same under a background pressure of 4 rho0 U^2",
          LAYER, shear_layer, 128, 2.0, thickness=_THIN, reynolds=1e6,
          background_pressure=4000.0, slow=True, wrong=_DEEP),
    _case("shear-layer/thin-long-stiff", "the same at half the Mach number, 0.05",
          LAYER, shear_layer, 128, 2.0, thickness=_THIN, reynolds=1e6,
          background_pressure=4000.0, mach=0.05, time_step=6.25e-4, slow=True),
    _case("gresho/inviscid", "32 x 32, without viscosity, 2 s", LAYER, gresho_vortex, 32, 2.0),
    _case("standing-wave/long", "40 dx long, 12 s", POOL, standing_wave, 40, 12.0, slow=True),
    _case("standing-wave/start", "32 dx long, 3 s", POOL, standing_wave, 32, 3.0),
    _case("drop/tension", "24 dx across, 2 s", TENSION_DROP, oscillating_drop, 24, 2.0),
    _case("drop/tension-long", "60 dx across, 6 s: two periods", TENSION_DROP, oscillating_drop,
          60, 6.0, slow=True),
)  # fmt: skip
