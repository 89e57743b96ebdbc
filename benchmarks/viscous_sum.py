"""How much viscosity the viscous sum has: its decay rates over the exact ones, by h/dx and start.

    python -m benchmarks.viscous_sum

One right-hand side with laminar viscosity alone, on two smooth periodic flows: the Taylor-Green
vortex and a shear along a lattice line. The ratio is that of the decay rate of kinetic energy to
the exact one; 1 is exact. Time is that of one right-hand side.
"""

from __future__ import annotations

import time as clock
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp

from jaxsph import ParticleState, SPHFunctional
from jaxsph.arrangements import JitteredLattice, Lattice, Packed
from jaxsph.cli import positive_float, positive_int
from jaxsph.effects import LaminarViscosity
from jaxsph.environment import environment
from jaxsph.scenes import taylor_green
from jaxsph.schemes import DeltaPlus

from .measure import format_rows, number, write_json
from .table import command

VISCOSITY = 0.01  # m^2/s
STARTS = {
    "lattice": Lattice(),
    "packed": Packed(),
    "jittered 0.25": JitteredLattice(amplitude=0.25),
}


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("viscous_sum", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--resolutions", type=positive_int, nargs="+", default=[50, 100], metavar="N",
        help="particles per side (default: 50 100)")  # fmt: skip
    add("--h-over-dx", type=positive_float, nargs="+", default=[1.5, 2.0, 3.0, 4.0], metavar="X",
        help="smoothing lengths over spacing (default: 1.5 2 3 4)")  # fmt: skip


def _run(options) -> None:
    rows = [
        measure(resolution, h_over_dx, name)
        for resolution in options.resolutions
        for h_over_dx in options.h_over_dx
        for name in STARTS
    ]
    results = {"rows": rows, "device": jax.devices()[0].device_kind, "environment": environment()}
    write_json(options.json, results)
    print(_table(rows))


def measure(resolution: int, h_over_dx: float, start: str) -> dict[str, Any]:
    """Ratios of decay rates of one arrangement of particles."""
    scene = taylor_green(resolution, h_over_dx=h_over_dx, arrangement=STARTS[start],
        scheme=DeltaPlus())
    functional = SPHFunctional(
        (LaminarViscosity(jnp.asarray(VISCOSITY)),), scene.fluid, scene.mass, scene.space
    )
    x = scene.state.position
    neighbors = scene.search(margin=1.3).build(x)
    k = 2.0 * jnp.pi
    across = jnp.sin(k * x[:, 1])
    flows = {  # velocity, and the sum of its wave numbers squared
        "taylor_green": (scene.state.velocity, 2.0 * k**2),
        "shear": (jnp.stack([across, jnp.zeros_like(across)], axis=1), k**2),
    }
    density = jnp.full_like(scene.state.density, scene.fluid.reference_density)
    rates = eqx.filter_jit(lambda f, s, n: f(jnp.zeros(()), s, n).velocity)
    row = {"resolution": resolution, "h_over_dx": h_over_dx, "start": start}
    for name, (velocity, squared) in flows.items():
        state = ParticleState(x, velocity, density)
        jax.block_until_ready(rates(functional, state, neighbors))
        begin = clock.perf_counter()
        rate = jax.block_until_ready(rates(functional, state, neighbors))
        row["seconds"] = clock.perf_counter() - begin
        exact = -VISCOSITY * squared * jnp.sum(velocity**2)
        row[f"{name}_ratio"] = float(jnp.sum(rate * velocity) / exact)
    return row


def _table(rows: list[dict[str, Any]]) -> str:
    header = ("side", "h/dx", "start", "Taylor-Green", "shear", "ms")
    cells = [
        (
            str(row["resolution"]),
            number(row["h_over_dx"]),
            row["start"],
            number(row["taylor_green_ratio"], 5),
            number(row["shear_ratio"], 5),
            number(1e3 * row["seconds"]),
        )
        for row in rows
    ]
    return format_rows(header, cells)


if __name__ == "__main__":
    raise SystemExit(main())
