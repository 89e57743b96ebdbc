"""Flows that both schemes are run on, and how each run is judged."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import (
    BallRegion,
    Box,
    BoxRegion,
    Fluid,
    MovingWall,
    ParticleState,
    Space,
    Walls,
)
from jaxsph.arrangements import JitteredLattice, Lattice
from jaxsph.effects import FreeSlip, Gravity
from jaxsph.kernels import WendlandC2
from jaxsph.metrics import local_quadratic
from jaxsph.scenes import (
    Scene,
    couette,
    lid_driven_cavity,
    poiseuille,
    taylor_green,
    taylor_green_3d,
)
from jaxsph.scenes import plane_flow_solution as plane
from jaxsph.scenes import taylor_green_solution as vortex

from .references.lid_driven_cavity import LIDS, PROBE_RADIUS, solve
from .references.taylor_green_3d import kinetic_energy

_INNER, _OUTER = 0.3, 0.6  # radii of cylinders [m]


def _with_snapshots(scene: Scene, wanted: int) -> Scene:
    each = max(k for k in range(1, max(1, scene.steps // wanted) + 1) if scene.steps % k == 0)
    return dataclasses.replace(scene, steps_per_snapshot=each)


def _vortex(case, scheme):
    step = 1.0 / (2 * round(3.14 * case["side"] * 0.1 / case["mach"]))
    return taylor_green(
        case["side"], case["reynolds"], mach=case["mach"], time_step=step, scheme=scheme
    )


def _vortex_errors(case, scene, trajectory):
    position, time = jnp.asarray(trajectory.position[-1]), float(trajectory.time[-1])
    viscosity = 1.0 / case["reynolds"]
    velocity = np.asarray(vortex.velocity(position, time, viscosity))
    pressure = np.asarray(vortex.pressure(position, time, viscosity, 1000.0))
    found = trajectory.velocity[-1], trajectory.pressure[-1] - trajectory.pressure[-1].mean()
    energy = 0.5 * np.exp(-16.0 * np.pi**2 * viscosity * time)
    pressure = pressure - pressure.mean()
    return {
        "energy_error_percent": 100.0 * ((found[0] ** 2).sum(axis=1).mean() / energy - 1.0),
        "velocity_error_percent": _apart(found[0], velocity),
        "pressure_error_percent": _apart(found[1], pressure),
        "momentum": float(np.abs(found[0].mean(axis=0)).max()),
    }


def _space(case, scheme):
    return taylor_green_3d(case["side"], case["reynolds"], scheme=scheme)


def _space_errors(case, scene, trajectory):
    found = 0.5 * (trajectory.velocity[-1] ** 2).sum(axis=1).mean()
    exact = kinetic_energy(case["reynolds"], float(trajectory.time[-1]))
    return {"energy_error_percent": float(100.0 * (found / exact - 1.0))}


def _apart(found, wanted) -> float:
    return float(100.0 * np.linalg.norm(found - wanted) / np.linalg.norm(wanted))


def _channel(case, scheme):
    make = {"couette": couette, "poiseuille": poiseuille}[case["kind"]]
    scene = make(case["side"], case["reynolds"], end_time=2.0, scheme=scheme)
    return _with_snapshots(scene, 40)


def _channel_errors(case, scene, trajectory):
    viscosity, found = 1.0 / case["reynolds"], {}
    for time in (0.25, 0.5, 1.0, 2.0):
        k = trajectory.nearest(time)
        height, at = trajectory.position[k][:, 1], float(trajectory.time[k])
        if case["kind"] == "couette":
            along = plane.couette(height, at, viscosity)
        else:
            along = plane.poiseuille(height, at, viscosity, 8.0 * viscosity)
        found[f"{at:g}"] = _apart(trajectory.velocity[k][:, 0], along)
    return {"velocity_error_percent_at": found, "velocity_error_percent": max(found.values())}


def _box(case, scheme):
    """The unit box, particles jittered by a fifth of a spacing, U = 1 m/s, c0 = 10 m/s."""
    dim, dx, end = case["dim"], 1.0 / case["side"], 20.0
    periodic = case["walls"] == "periodic"
    box = Box((0.0,) * dim, (1.0,) * dim, (periodic,) * dim)
    space, region = Space(box, WendlandC2(), 2.0 * dx, dx), BoxRegion(box.lower, box.upper)
    position = JitteredLattice(0.2).positions(space)
    speed = 0.02 if case["start"] == "kick" else 0.0
    velocity = speed * jax.random.normal(jax.random.key(1), position.shape)
    force, density = None, jnp.ones(len(position))
    if case["start"] == "gravity":
        force = Gravity(jnp.zeros(dim).at[dim - 1].set(-1.0))
        density = density + (1.0 - position[:, dim - 1]) / 100.0
    effects = scheme.effects(1.0 / case["reynolds"], force, None if periodic else region)
    every = round(end / 20.0 / (0.2 * dx))
    return Scene(
        "box", effects, Fluid(1.0, 10.0, 1.0), space, ParticleState(position, velocity, density),
        end / (20 * every), end, every, walls=None if periodic else Walls.around(region, space),
    )  # fmt: skip


def _disc(case, scheme):
    """A disc of fluid of radius 0.6 m in rotation by 1 rad/s, between free-slip walls."""
    dx = 1.2 / case["side"]
    box, region = Box((0.0, 0.0), (1.4, 1.4), (False, False)), BallRegion((0.7, 0.7), 0.6)
    space = Space(box, WendlandC2(), 2.0 * dx, dx)
    position = Lattice().positions(space)
    position = position[np.asarray(region.signed_distance(position)) < -0.25 * dx]
    offset = position - 0.7
    velocity = jnp.stack([-offset[:, 1], offset[:, 0]], axis=1)
    density = 1000.0 + 5.0 * (jnp.sum(offset**2, axis=1) - 0.36)
    effects = scheme.effects(1.0 / case["reynolds"], None, region, FreeSlip())
    return Scene(
        "disc", effects, Fluid(1000.0, 10.0, 1.0), space,
        ParticleState(position, velocity, density), 20.0 / 1400, 20.0, 70,
        walls=Walls.around(region, space),
    )  # fmt: skip


def _taylor_couette(case, scheme):
    """Fluid between a cylinder of radius 0.3 m that turns by 1 rad/s and one of 0.6 m at rest."""
    dx, center = 1.2 / case["side"], (0.8, 0.8)
    box, inner = Box((0.0, 0.0), (1.6, 1.6), (False, False)), BallRegion(center, _INNER)
    space = Space(box, WendlandC2(), 2.0 * dx, dx)
    region = BallRegion(center, _OUTER) & ~inner
    turning = MovingWall(inner, lambda x: jnp.stack([0.8 - x[:, 1], x[:, 0] - 0.8], axis=1))
    walls = Walls.around(region, space, moving=(turning,))
    position = Lattice().positions(space)
    position = position[np.asarray(region.signed_distance(position)) < 0.0]
    position = walls.put_inside(position, 0.25 * dx)
    effects = scheme.effects(1.0 / case["reynolds"], None, region)
    state = ParticleState(position, jnp.zeros_like(position), jnp.full(len(position), 1000.0))
    steps = round(20.0 / (0.1 * dx) / 100)
    return Scene(
        "taylor-couette", effects, Fluid(1000.0, 10.0, 1.0), space, state, 20.0 / (100 * steps),
        20.0, steps, walls=walls,
    )  # fmt: skip


def _azimuthal_errors(case, scene, trajectory):
    """Of the velocity around, a r + b / r once steady, over the last second, in rms of itself."""
    late = trajectory.time > trajectory.time[-1] - 1.0
    offset = trajectory.position[late] - 0.8
    radius = np.linalg.norm(offset, axis=2)
    around = offset[..., 0] * trajectory.velocity[late][..., 1]
    around = (around - offset[..., 1] * trajectory.velocity[late][..., 0]) / radius
    slope = -(_INNER**2) / (_OUTER**2 - _INNER**2)
    exact = slope * (radius - _OUTER**2 / radius)
    return {"velocity_error_percent": _apart(around, exact)}


def _momentum_kept(case, scene, trajectory):
    offset = trajectory.position - 0.7
    turned = offset[..., 0] * trajectory.velocity[..., 1]
    turned = (turned - offset[..., 1] * trajectory.velocity[..., 0]).sum(axis=1)
    return {"angular_momentum_kept": float(turned[-1] / turned[0])}


def _cavity(case, scheme):
    scene = lid_driven_cavity(
        case["side"], case["reynolds"], lid=case["lid"], end_time=case["end"], scheme=scheme,
    )  # fmt: skip
    return _with_snapshots(scene, round(5 * case["end"]))


def _cavity_errors(case, scene, trajectory):
    """Largest deviations on the centre lines, means over the last second."""
    at = np.linspace(0.02, 0.98, 25)
    lines = np.stack([0.0 * at + 0.5, at], axis=1), np.stack([at, 0.0 * at + 0.5], axis=1)
    exact = solve(case["reynolds"], LIDS[case["lid"]])
    radius, errors = PROBE_RADIUS * scene.space.spacing, {}
    start = trajectory.time[-1] - 1.0
    for name, points, component in (("u", lines[0], 0), ("v", lines[1], 1)):
        found = np.mean([
            local_quadratic(
                points, trajectory.position[k], trajectory.velocity[k][:, component], radius
            )
            for k in np.flatnonzero(trajectory.time > start)
        ], axis=0)  # fmt: skip
        apart = np.abs(found - exact.velocity(points)[:, component])
        errors[f"{name}_error_percent"] = float(100.0 * apart.max())
        errors[f"{name}_rms_error_percent"] = float(100.0 * np.sqrt((apart**2).mean()))
    energy = (trajectory.velocity**2).sum(axis=(1, 2))
    before = trajectory.nearest(0.75 * case["end"])
    errors["change_in_last_quarter_percent"] = float(100.0 * (energy[-1] / energy[before] - 1.0))
    return errors


KINDS = {
    "vortex": (_vortex, _vortex_errors),
    "couette": (_channel, _channel_errors),
    "poiseuille": (_channel, _channel_errors),
    "box": (_box, lambda case, scene, trajectory: {}),
    "disc": (_disc, _momentum_kept),
    "taylor-couette": (_taylor_couette, _azimuthal_errors),
    "space": (_space, _space_errors),
    "cavity": (_cavity, _cavity_errors),
}
