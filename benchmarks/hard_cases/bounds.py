"""The bounds that hard cases keep, with the reasons for their sizes."""

from __future__ import annotations

from .measures import (
    Bound,
    beyond_walls,
    density_deviation,
    energy_change,
    energy_left,
    energy_over_reference,
    energy_over_start,
    highest_speed,
    hydrostatic_error,
    least_distance,
    momentum_drift,
    unevenness,
    volume_spread,
)

DENSITY = Bound(
    "density", density_deviation, 0.03,
    "pressures of order rho0 U^2 compress by Ma^2 = 0.01; three times that leaves room for sound",
)  # fmt: skip
LOOSE_DENSITY = Bound(
    "density", density_deviation, 0.2,
    "the library's own bounds, beyond which it names a fault",
)  # fmt: skip
DECAY = Bound(
    "energy over start", energy_over_start, 1.01,
    "nothing drives the flow; sound may give back what compression holds, a share Ma^2 = 0.01",
)  # fmt: skip
RELEASE = Bound(
    "energy over start", energy_over_start, 3.0,
    "nothing drives the flow, but the pressure of the start, of the size of the kinetic energy, "
    "pushes fluid into the empty part",
)  # fmt: skip
UNCHANGED = Bound(
    "energy change", energy_change, 1e-12,
    "no force acts: the same to round-off",
)  # fmt: skip
AT_REST = Bound(
    "highest speed", highest_speed, 0.05,
    "at rest at the start; only the uneven place may stir",
)  # fmt: skip
FAST = Bound(
    "highest speed", highest_speed, 3.0,
    "sets of particles with empty places around them may fly apart, well below the sound speed",
)  # fmt: skip
DRIVEN = Bound(
    "energy over reference", energy_over_reference, 0.1,
    "of fluid all at the lid's speed; the steady vortex under a uniform lid has 0.089 at Re = 1000 "
    "(Bruneau and Saad 2006)",
)  # fmt: skip
LID_SPEED = Bound(
    "highest speed", highest_speed, 1.2,
    "no fluid outruns the lid by more than its noise",
)  # fmt: skip
INFLOW_SPEED = Bound(
    "highest speed", highest_speed, 1.2,
    "no fluid outruns the inflow's peak by more than its noise",
)  # fmt: skip
CHANNEL_SPEED = Bound(
    "highest speed", highest_speed, 1.0,
    "the reference speed is what the kick is sized for",
)  # fmt: skip
STILL = Bound(
    "energy over reference", energy_over_reference, 1e-5,
    "nothing should move: what stirs is slower than 0.003 sqrt(g H)",
)  # fmt: skip
HYDROSTATIC = Bound(
    "hydrostatic error", hydrostatic_error, 0.05,
    "the column rings from the start on, with the period 2 H / c0 of its sound and up to 0.023",
)  # fmt: skip
MOMENTUM = Bound(
    "momentum drift", momentum_drift, 2e-3,
    "forces of pairs cancel, transport by shifting does not quite: 0.2 percent of N m U",
)  # fmt: skip
DISTANCE = Bound(
    "least distance", least_distance, 0.2,
    "the closest pair of all particles and snapshots; two that stick together are nearer",
    at_least=True,
)  # fmt: skip
EVEN = Bound(
    "unevenness", unevenness, 0.2,
    "0 on a lattice, 0.26 for particles at random places (a Poisson process)",
)  # fmt: skip
VOLUME = Bound(
    "volume spread", volume_spread, 0.05,
    "0 on a lattice, 0.028 on the jittered one that a case starts from",
)  # fmt: skip
WALLS = Bound(
    "beyond walls", beyond_walls, 0.0,
    "nothing passes through a wall",
)  # fmt: skip

FALL = Bound(
    "energy over reference", energy_over_reference, 0.15,
    "a column of height H that falls into a layer gives m g H / 2, a ninth of U = 3 (g H)^1/2",
)  # fmt: skip
JET = Bound(
    "highest speed", highest_speed, 6.4,
    "jets of an impact, twice U = 3 (g H)^1/2 = 3.2 m/s at most",
)  # fmt: skip
CAPILLARY = Bound(
    "energy over start", energy_over_start, 1.1,
    "tension without exact conservation of momentum may feed a tenth of the oscillation's energy",
)  # fmt: skip
WAVE = Bound(
    "energy over start", energy_over_start, 1.05,
    "the level start holds no potential energy of the wave; sound adds a few percent",
)  # fmt: skip

JOLT = Bound(
    "density", density_deviation, 0.1,
    "a layer thinner than a spacing starts as a jump of 2 U between rows, whose sound is loud",
)  # fmt: skip

AT_END = Bound(
    "energy left", energy_left, 1e-3,
    "nothing comes in any more, and friction has had 4 pi^2 nu / H^2 = 4 1/s for 2 s",
)  # fmt: skip

SPLASH = (LOOSE_DENSITY, FALL, JET, WALLS)
PATCH = (DENSITY, DECAY)
LAYER = (DENSITY, DECAY, MOMENTUM, DISTANCE, EVEN)
UNRESOLVED = (JOLT, DECAY, MOMENTUM, EVEN)
PUSHED = (DENSITY, WALLS, DISTANCE, EVEN)
POOL = (DENSITY, WAVE, WALLS, DISTANCE, EVEN)
TENSION_DROP = (DENSITY, CAPILLARY, DISTANCE, EVEN)
VORTEX = (DENSITY, DECAY, MOMENTUM, DISTANCE, EVEN, VOLUME)
CAVITY = (DENSITY, DRIVEN, LID_SPEED, WALLS, DISTANCE, EVEN)
CHANNEL = (DENSITY, CHANNEL_SPEED, WALLS, DISTANCE, EVEN)
PULSED = (DENSITY, INFLOW_SPEED, WALLS, DISTANCE, EVEN)
STOPPED = (*PULSED, AT_END)
STRUCK = (LOOSE_DENSITY, FAST, WALLS, DISTANCE, EVEN)
SWUNG = Bound(
    "density", density_deviation, 0.05,
    "an inflow that swings with w needs w U L / c0^2 = 0.02 over the channel and its buffers, and "
    "half as much again where the outlet lets sound out",
)  # fmt: skip
GAINING = Bound(
    "highest speed", highest_speed, 4.0,
    "twice the inflow's speed on top of it at the start, and what a third more pressure inside "
    "than at the outlet gives it",
)  # fmt: skip
THROUGH = (SWUNG, INFLOW_SPEED, WALLS, DISTANCE, EVEN)
LEAVING = (LOOSE_DENSITY, GAINING, WALLS, DISTANCE, EVEN)
TANK = (DENSITY, STILL, HYDROSTATIC, WALLS, DISTANCE, EVEN)
SCATTERED = (LOOSE_DENSITY, FAST)
