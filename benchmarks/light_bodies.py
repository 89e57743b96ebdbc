"""Light bodies: the longest step at which they are stable, and how they start to rise.

    python -m benchmarks.light_bodies

A cylinder 0.2 m across, 10 dx at 60 particles along the tank, is let go 0.3 m under the surface of
a tank of 1.2 m x 0.6 m. For each density over the water's the steps are shortened, in shares of
1.5 h / c0, until a run of 0.1 s has no fault and no body faster than 6 m/s, six times what its
buoyancy gives it. The row of the last, stable one has the mean acceleration over 0.05 s as well,
beside that of a potential flow in the same tank. A row is in the JSON file once it is done.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve

from jaxsph import BallRegion, Box, BoxRegion, FreeBody, Walls
from jaxsph.arrangements import Lattice
from jaxsph.cli import positive_float, positive_int
from jaxsph.effects import ArtificialViscosity, Gravity
from jaxsph.environment import environment
from jaxsph.full_model import CFL
from jaxsph.integrate import integrate
from jaxsph.scenes import Scale, Scene, composed
from jaxsph.schemes import SCHEMES

from .measure import format_rows, number, tell
from .table import Table, command

KEY = ("scheme", "resolution", "ratio")
RATIOS = (1.0, 0.1, 0.05, 0.02, 0.01, 0.005)
SHARES = (1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12, 0.08)
LENGTH, DEPTH, TOP, RADIUS, CENTRE = 1.2, 0.6, 1.0, 0.1, (0.6, 0.3)  # m
DENSITY, GRAVITY = 1000.0, 9.81
END, RISE, WILD = 0.1, 0.05, 6.0  # s, s, m/s
GRID = 480  # cells along the tank, of the potential flow


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("light_bodies", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--resolutions", type=positive_int, nargs="+", default=[60], metavar="N",
        help="particles along the tank (default: 60)")  # fmt: skip
    add("--schemes", choices=tuple(SCHEMES), nargs="+", default=["consistent", "delta-plus"],
        help="default: consistent delta-plus")  # fmt: skip
    add("--ratios", type=positive_float, nargs="+", default=list(RATIOS), metavar="X",
        help="of the body's density to the water's")  # fmt: skip


def _run(options) -> None:
    kept = Table(options.json, KEY, beside=lambda rows: {"environment": environment()})
    for resolution in options.resolutions:
        for scheme in options.schemes:
            made = cache(lambda n=resolution, s=scheme: Released(submerged(n, s)))
            cases = (dict(zip(KEY, (scheme, resolution, r), strict=True)) for r in options.ratios)
            for case in kept.left(cases):
                kept.add(case | made().of(case["ratio"]))
                tell(f"{scheme}, {resolution}, {case['ratio']:g}")
    names = ("limit_share", "stable_share", "lost_share", "acceleration", "potential_acceleration")
    rows = [(*(str(r[n]) for n in KEY), *(number(r[n], 3) for n in names)) for r in kept.rows]
    header = ("limit", "stable at", "lost at", "rises at", "potential flow")
    print(format_rows((*KEY, *header), rows))


def submerged(resolution: int, scheme: str, ratio: float = 1.0) -> Scene:
    """The cylinder under water, of a density over the water's."""
    body = BallRegion(CENTRE, RADIUS)
    tank = BoxRegion((0.0, 0.0), (LENGTH, TOP))
    return composed(
        "submerged-cylinder",
        effects=SCHEMES[scheme].free_surface_effects(
            ArtificialViscosity(jnp.asarray(0.02)),
            force=Gravity(jnp.asarray([0.0, -GRAVITY])),
            vessel=tank,
        ),
        box=Box((0.0, 0.0), (LENGTH, TOP), (False, False)),
        scale=Scale(resolution, 2.0, 0.06 / resolution, 5),
        end_time=END,
        reference_density=DENSITY,
        reference_speed=math.sqrt(GRAVITY * DEPTH),
        region=BoxRegion((0.0, 0.0), (LENGTH, DEPTH)) & ~body,
        walls=lambda space: Walls.around(
            tank, space, free_bodies=(FreeBody.of_density(body, DENSITY * ratio, space),)
        ),
        pressure=lambda x: DENSITY * GRAVITY * (DEPTH - x[:, 1]),
        arrangement=Lattice(),
    )


class Released:
    """Runs of one scene with bodies of any mass, by one compiled program."""

    def __init__(self, scene: Scene):
        self.scene, self.whole = scene, scene.model(margin=2.0)
        self.acoustic = CFL * scene.space.smoothing_length / float(scene.fluid.sound_speed)
        self._interval = jax.jit(lambda model, y, dt: integrate(model, y, 0, dt, 25, 1)[:2])

    def of(self, ratio: float) -> dict[str, Any]:
        """The row of a density over the water's."""
        body = self.scene.walls.free.parts[0]
        model = eqx.tree_at(
            lambda m: [getattr(_body(m), name) for name in ("mass", "inertia")],
            self.whole,
            [ratio * body.mass, ratio * body.inertia],
        )
        limit = float(model.functional.walls.free.step_share(self.scene.fluid.reference_density))
        lost = None
        for share in SHARES:
            rise = self._rise(model, share * self.acoustic)
            if rise is not None:
                break
            lost = share
        return {
            "limit_share": limit,
            "stable_share": share if rise is not None else None,
            "lost_share": lost,
            "acceleration": rise,
            "potential_acceleration": potential_acceleration(ratio),
        }

    def _rise(self, model, dt: float) -> float | None:
        """Mean acceleration over the first part of a run; None if that is lost."""
        state, time, rise = self.scene.state, 0.0, None
        while time < END:
            state, fault = self._interval(model, state, jnp.asarray(dt))
            time += 25 * dt
            speed = np.abs(np.asarray(state.bodies.velocity)).max()
            if int(fault.code) or not speed < WILD:
                return None
            if rise is None and time >= RISE:
                way = float(state.bodies.position[0, 1]) - CENTRE[1]
                rise = 2.0 * way / time**2
        return rise


def _body(model):
    return model.functional.walls.bodies.free.parts[0]


def potential_acceleration(ratio: float) -> float:
    """(M0 - M) g / (M + A) [m/s^2] of the cylinder at rest, M0 the water's mass in its place."""
    place = DENSITY * math.pi * RADIUS**2
    return (1.0 - ratio) * GRAVITY * place / (ratio * place + added_mass())


@cache
def added_mass() -> float:
    """A [kg] for rising: laplace(phi) = 0, d phi / dn = n_y on the cylinder, zero on all walls, and
    phi = 0 on the free surface; A = rho0 sum phi n_y dA, on a lattice whose cells are in or out,
    scaled by what is exact of the cylinder alone in a round vessel of the same cells."""
    dx = LENGTH / GRID
    x, y = (np.arange(n) * dx + 0.5 * dx for n in (GRID, round(DEPTH / dx)))
    inside = np.hypot(x[:, None] - CENTRE[0], y[None] - CENTRE[1]) < RADIUS
    found = _rising(~inside, dx, np.zeros_like(inside))
    # the same staircase in a vessel three times as wide, held at phi = 0
    around = np.hypot(x[:, None] - CENTRE[0], y[None] - CENTRE[1]) > 2.8 * RADIUS
    exact = math.pi * RADIUS**2 * (2.8**2 - 1.0) / (2.8**2 + 1.0)
    return DENSITY * found * exact / _rising(~inside, dx, around)


def _rising(wet: np.ndarray, dx: float, still: np.ndarray) -> float:
    """A / rho0 [m^2] of what is not wet, for phi = 0 on top and in the cells that are still."""
    number = np.full(wet.shape, -1)
    number[wet] = np.arange(wet.sum())
    rows, columns, values = [], [], []
    for a, b in ((number[:-1], number[1:]), (number[:, :-1], number[:, 1:])):
        both = (a >= 0) & (b >= 0)
        i, j = a[both], b[both]
        rows += [i, j, i, j]
        columns += [j, i, i, j]
        values += [-np.ones(len(i))] * 2 + [np.ones(len(i))] * 2
    held = np.concatenate([number[:, -1], number[still & wet]])
    rows, columns = rows + [held], columns + [held]
    values = values + [np.concatenate([np.full(len(number), 2.0), np.full(still[wet].sum(), 1e9)])]
    links = coo_matrix(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    ).tocsc()
    flux = np.zeros(links.shape[0])
    above = number[:, 1:][~wet[:, :-1] & wet[:, 1:]]
    below = number[:, :-1][wet[:, :-1] & ~wet[:, 1:]]
    flux[above], flux[below] = dx, -dx
    return float(flux @ spsolve(links, flux))


if __name__ == "__main__":
    raise SystemExit(main())
