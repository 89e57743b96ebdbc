"""What each effect costs when it is added to a bare scene: time of a right-hand side, in turns.

    python -m benchmarks.effect_cost --resolution 100

The bare scene is a periodic square with continuity and pressure alone. Each row adds one effect,
with the effects whose fields it needs. `FreeSurface` alone is free: fields that nothing reads are
not computed.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import matplotlib

from jaxsph.arrangements import JitteredLattice
from jaxsph.cli import positive_float, positive_int
from jaxsph.effects import (
    ArtificialViscosity,
    BackgroundPressure,
    CentralForce,
    Continuity,
    DensityDiffusion,
    Effect,
    FreeSurface,
    Gravity,
    IsotropicViscosity,
    LaminarViscosity,
    ParticleShifting,
    PressureForce,
    ShiftingTransport,
    SurfaceDiffusion,
    SurfaceShifting,
    SurfaceTension,
    TensileControl,
)
from jaxsph.environment import environment
from jaxsph.io import check_target
from jaxsph.scenes import taylor_green
from jaxsph.schemes import DeltaPlus

from .measure import (
    alternate,
    compiled,
    format_rows,
    interacting_pairs,
    number,
    summary,
    tell,
    write_json,
)
from .table import command

FIGURE = Path("docs/figures/effect_cost.png")


def ladder() -> list[tuple[Effect, tuple[Effect, ...]]]:
    """Each effect and those that it needs before it, beyond continuity and pressure."""
    shifting, surface, diffusion = ParticleShifting(), FreeSurface(), DensityDiffusion(0.1)
    return [
        (Gravity(jnp.asarray([0.0, -1.0])), ()),
        (CentralForce(1.0, (0.5, 0.5)), ()),
        (LaminarViscosity(0.01), ()),
        (IsotropicViscosity(0.01), ()),
        (ArtificialViscosity(0.02), ()),
        (BackgroundPressure(1.0), ()),
        (TensileControl(), ()),
        (diffusion, ()),
        (shifting, ()),
        (ShiftingTransport(), (shifting,)),
        (surface, ()),
        (SurfaceShifting(), (shifting, surface)),
        (SurfaceDiffusion(), (diffusion, surface)),
        (SurfaceTension(1.0), (surface,)),
    ]


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("effect_cost", __doc__, _arguments, _run, argv)


def _run(options) -> None:
    check_target(options.figure)
    results = measured(options.resolution, options.h_over_dx, options.repeats)
    write_json(options.json, results | environment())
    draw(results["rows"], options.figure)
    print(_table(results["rows"]))


def _arguments(add) -> None:
    add("--resolution", type=positive_int, default=100, metavar="N", help="default: 100")
    add("--h-over-dx", type=positive_float, default=2.0, metavar="X", help="default: 2")
    add("--repeats", type=positive_int, default=15, metavar="K", help="default: 15")
    add("--figure", type=Path, default=FIGURE, metavar="FILE", help=f"default: {FIGURE}")


def measured(resolution: int, h_over_dx: float, repeats: int) -> dict[str, Any]:
    """Times of the bare scene and of each effect on it, all taken in turns."""
    scene = taylor_green(resolution, h_over_dx=h_over_dx, arrangement=JitteredLattice(),
        scheme=DeltaPlus())
    bare = (Continuity(), PressureForce())
    sets = {(): bare}
    for effect, needed in ladder():
        for extra in (needed, (*needed, effect)):
            sets.setdefault(tuple(e.name for e in extra), (*bare, *extra))
    neighbors = scene.search().build(scene.state.position)
    calls, compile_seconds = {}, {}
    for names, effects in sets.items():
        tell(f"compiling: {', '.join(names) or 'bare'}")
        functional = dataclasses.replace(scene, effects=effects).functional()
        call, seconds = compiled(
            lambda *a, f=functional: f(*a), jnp.zeros(()), scene.state, neighbors
        )
        calls[names], compile_seconds[names] = call, seconds
    wall, _ = alternate(calls, repeats)
    times = {names: summary(seconds) for names, seconds in wall.items()}
    rows = []
    for effect, needed in ladder():
        before = tuple(e.name for e in needed)
        after = (*before, effect.name)
        least = {names: times[names]["min"] for names in ((), before, after)}
        rows.append({
            "effect": effect.name,
            "needs": list(before),
            "seconds": times[after],
            "compile_seconds": compile_seconds[after],
            "over_bare": least[after] / least[()],
            "alone_over_bare": (least[after] - least[before]) / least[()],
        })  # fmt: skip
    return {
        "particles": len(scene.state.position),
        "pairs": interacting_pairs(scene.state.position, scene.space),
        "h_over_dx": h_over_dx,
        "bare_seconds": times[()],
        "rows": rows,
    }


def draw(rows: list[dict[str, Any]], path: Path) -> None:
    """Bars of what each effect adds, in units of the bare right-hand side."""
    matplotlib.use("Agg")
    from matplotlib import pyplot

    rows = sorted(rows, key=lambda row: row["alone_over_bare"])
    figure, axes = pyplot.subplots(figsize=(7.0, 4.2))
    names = [
        f"{row['effect']}  (with {', '.join(row['needs'])})" if row["needs"] else row["effect"]
        for row in rows
    ]
    added = [row["alone_over_bare"] for row in rows]
    axes.barh(names, added, color="#0072B2")
    for place, value in enumerate(added):
        axes.text(max(value, 0.0) + 0.01, place, f"{100.0 * value:.0f} %", va="center", fontsize=8)
    axes.set_xlabel("time added / time of the bare scene")
    axes.set_xlim(min(0.0, *added), 1.15 * max(added))
    axes.tick_params(axis="y", labelsize=8)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
    pyplot.close(figure)


def _table(rows: list[dict[str, Any]]) -> str:
    return format_rows(
        ("effect", "with", "time [ms]", "adds [% of bare]"),
        [
            (
                row["effect"],
                ", ".join(row["needs"]) or "-",
                number(1e3 * row["seconds"]["median"]),
                number(100.0 * row["alone_over_bare"]),
            )
            for row in rows
        ],
    )


if __name__ == "__main__":
    raise SystemExit(main())
