"""How time and memory grow: with particles, neighbours, modes, and the steps of a gradient.

    python -m benchmarks.growth --particles 1000 10000 100000 1000000

The Taylor-Green vortex from a jittered lattice, float64: the full model, the reduced model on
moving particles (local splines, Galerkin), the tensors, and gradients through the loop. A step is
one of five that `integrate` makes in one call, as in a run: neighbour lists are built anew when
they are due, and memory is taken once; a list or a right-hand side alone takes it in every call.
Every case is measured in a process of its own, as the peak of memory only grows.
Finished cases are kept in the JSON file: the same command goes on.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass, field
from functools import partial
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import COMPILER_OPTIONS
from jaxsph.arrangements import JitteredLattice, Lattice
from jaxsph.cli import fail, positive_int
from jaxsph.environment import environment
from jaxsph.integrate import FaultCode, integrate
from jaxsph.metrics import kinetic_energy
from jaxsph.plotting import style
from jaxsph.scenes import Scene, taylor_green
from jaxsph.schemes import DeltaPlus
from jaxsph_rom import Basis, Energy, Galerkin, LocalSplines, ReducedModel
from jaxsph_rom.points import PointsModel, QuadraticSystem

from . import measure
from .table import Table, command

FULL, NEIGHBORS, MOVING, MOVING_MODES = "full", "neighbors", "moving", "moving-modes"
TENSORS, GRADIENT = "tensors", "gradient"
STEP, RATES, LIST, RUN = "step", "right-hand side", "neighbour list", "run"
ALONG = {  # what a family's cost is measured against
    TENSORS: "modes", GRADIENT: "steps", NEIGHBORS: "neighbors", MOVING_MODES: "modes",
    FULL: "particles", MOVING: "particles",
}  # fmt: skip
QUANTITIES: dict[str, Callable[[dict, dict], float]] = {  # of a row and one of its programs
    "seconds": lambda row, program: program["median"],
    "least seconds": lambda row, program: program["min"],
    "processor seconds": lambda row, program: program["processor"],  # least disturbed by others
    "compile seconds": lambda row, program: program["compile_seconds"],
    "peak memory": lambda row, program: program["peak_gib"] - row["start_gib"],
    "temporary memory": lambda row, program: program.get("temp_gib", np.nan),
}
CURVES = {  # label, colour, marker
    (FULL, STEP): ("full model, step", style.BLACK, "o"),
    (FULL, RATES): ("full model, right-hand side", style.BLUE, "^"),
    (FULL, LIST): ("full model, neighbour list", style.GREEN, "v"),
    (MOVING, STEP): ("reduced model on moving particles, step", style.VERMILLION, "s"),
    (TENSORS, STEP): ("tensors, step", style.SKY, "D"),
    (GRADIENT, RUN): ("full model, run", style.ORANGE, "p"),
    (GRADIENT, GRADIENT): ("full model, run and its gradient", style.PURPLE, "P"),
}
PANELS = (  # quantity, axis labels, families, each with the one whose curves it shares
    ("processor seconds", "particles", "processor time [s]", {FULL: FULL, MOVING: MOVING}),
    ("peak memory", "particles", "peak memory above start [GiB]", {FULL: FULL, MOVING: MOVING}),
    ("processor seconds", "neighbours of a particle", "processor time [s]", {NEIGHBORS: FULL}),
    ("processor seconds", "modes", "processor time [s]", {MOVING_MODES: MOVING, TENSORS: TENSORS}),
    ("processor seconds", "steps", "processor time [s]", {GRADIENT: GRADIENT}),
    ("temporary memory", "steps", "memory of the program [GiB]", {GRADIENT: GRADIENT}),
)
PLAN = ((1e3, 3e3, 1e4, 3e4, 1e5, 3e5, 1e6), (5, 10, 20, 40), (10, 20, 40, 80, 160, 320))
QUICK = ((400, 1000), (2, 4), (4, 8))  # particles, modes, steps
LIMIT = 16.0  # GiB, for a million particles
CLAIMED = (9_000, 1_100_000)  # particles between which linear growth is claimed
REYNOLDS = 1000.0  # low viscosity, so that dt/dx can be the same at all sizes
_TENSOR_STEPS, _STEPS = 1000, 5  # timed together: of tensors, of particles
_ENOUGH, _MOST = 2.0, 101  # seconds of repeats, and repeats, where they are quick


@dataclass(frozen=True)
class Case:
    """What is measured: a family, and the numbers that tell its members apart (0: none)."""

    family: str
    particles: int = 0
    h_over_dx: float = 0.0
    modes: int = 0
    steps: int = 0


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a case did not fit into memory, 2: bad input."""
    return command("growth", __doc__, _arguments, _run, argv, json="growth_{kind}.json")


def _arguments(add) -> None:
    add("--particles", type=positive_int, nargs="+", metavar="N",
        help="the nearest squares are taken (default: seven sizes from 1e3 to 1e6)")  # fmt: skip
    add("--families", choices=tuple(ALONG), nargs="+", default=tuple(ALONG), metavar="FAMILY",
        help=f"some of: {', '.join(ALONG)} (default: all)")  # fmt: skip
    add("--quick", action="store_const", const="quick", default="full", dest="kind",
        help="a trial at small sizes")  # fmt: skip
    add("--repeats", type=positive_int, default=7, metavar="K",
        help="at least; quick calls are made more often (default: %(default)s)")  # fmt: skip
    add("--figure", type=Path, metavar="FILE",
        help="default: docs/figures/growth.png, of a trial out/growth.png")  # fmt: skip


def _run(options) -> int:
    kept = Table(options.json, ("case",), beside=lambda rows: {"growth": growth(rows)})
    here = environment()
    if kept.results.setdefault("environment", here)["machine"] != here["machine"]:
        raise ValueError(f"{options.json}: is of another machine; name another file with --json.")
    lost = _measure(kept, cases(options), options.repeats)
    trial = options.kind == "quick"
    figure(kept.results, options.figure or Path("out" if trial else "docs/figures", "growth.png"))
    print(_table(kept.results))
    return fail("growth", f"lost, for want of memory: {lost}", 1) if lost else 0


def cases(options) -> list[Case]:
    """All cases asked for, the small ones first."""
    sizes, modes, steps = QUICK if options.kind == "quick" else PLAN
    squares = sorted({_side(n) ** 2 for n in options.particles or sizes})
    some, few = min(10_000, squares[-1]), min(1024, squares[-1])
    found = [Case(TENSORS, modes=m) for m in sorted({k * m for k in (1, 2, 4) for m in modes})]
    found += [Case(GRADIENT, few, 2.0, steps=s) for s in steps]
    found += [Case(NEIGHBORS, some, h) for h in (1.5, 2.0, 3.0, 4.0)]
    found += [Case(MOVING_MODES, some, 2.0, m) for m in modes]
    for n in squares:
        found += [Case(FULL, n, 2.0), Case(MOVING, n, 2.0, 10)]
    return [case for case in found if case.family in options.families]


def _side(particles: float) -> int:
    return max(1, round(particles**0.5))


def _measure(kept: Table, wanted: list[Case], repeats: int) -> list[Case]:
    """Measure the cases not yet there, each in a fresh process; those that were lost."""
    left, lost = [case for case in wanted if not kept.has((asdict(case),))], []
    measure.tell(f"{len(wanted) - len(left)} of {len(wanted)} cases done before")
    with measure.progress("cases", len(left)) as report:
        for case in left:
            try:
                with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as fresh:
                    kept.add(fresh.submit(measured, case, repeats).result())
            except (BrokenProcessPool, MemoryError, jax.errors.JaxRuntimeError):
                lost.append(case)
            report(1)
    return lost


@dataclass
class _Meter:
    """Programs of a case: compiled and called once, then timed in turns."""

    programs: dict[str, dict[str, Any]] = field(default_factory=dict)
    calls: dict[str, Callable[[], Any]] = field(default_factory=dict)
    seconds: float = 0.0  # of one call of each

    def first(self, name: str, function: Callable, *arguments, steps: int = 1) -> Any:
        """The result of the first call; how long it took to compile, and what memory it needs."""
        start = clock.perf_counter()
        program = jax.jit(function).lower(*arguments).compile(COMPILER_OPTIONS)
        compiled = clock.perf_counter()
        self.calls[name] = lambda: jax.block_until_ready(program(*arguments))
        result = self.calls[name]()
        self.seconds += clock.perf_counter() - compiled
        row = {"compile_seconds": compiled - start, "steps": steps}
        self.programs[name] = row | {"peak_gib": measure.peak_memory_gib()} | _memory(program)
        return result

    def timed(self, repeats: int) -> dict[str, Any]:
        """Times [s] of a step, of the clock and of all cores, from repeats in turn."""
        repeats = max(repeats, min(_MOST, int(_ENOUGH / self.seconds)))
        wall, busy = measure.alternate(self.calls, repeats)
        for name, row in self.programs.items():
            row |= measure.summary([seconds / row["steps"] for seconds in wall[name]])
            row["processor"] = float(np.median(busy[name])) / row["steps"]
        return self.programs


def _memory(program) -> dict[str, float]:
    """What the compiler says of a program's memory [GiB], where it says anything."""
    found = program.memory_analysis()
    kinds = () if found is None else ("argument", "output", "temp", "generated_code")
    return {f"{kind}_gib": getattr(found, f"{kind}_size_in_bytes") / 2.0**30 for kind in kinds}


def measured(case: Case, repeats: int) -> dict[str, Any]:
    """Times and memory of a case; the peaks are those of this process, best a fresh one."""
    with jax.enable_x64(True):
        environment()  # starts the device
        row, meter = {"case": asdict(case), "start_gib": measure.peak_memory_gib()}, _Meter()
        row |= _FAMILIES[case.family](case, meter)
        return row | {"programs": meter.timed(repeats)}


def _scene(case: Case) -> Scene:
    kinds = {"arrangement": JitteredLattice(), "scheme": DeltaPlus(), "dtype": "float64"}
    return taylor_green(_side(case.particles), REYNOLDS, h_over_dx=case.h_over_dx, **kinds)


def _run_of(model, state, time_step, steps: int = 1):
    """The last state and the fault's code, by the library's own loop."""
    first = jnp.zeros((), jnp.int32)
    state, fault, _, _ = integrate(model, state, first, time_step, steps, 1)
    return state, fault.code


def _good(run) -> None:
    if int(run[1]) != FaultCode.NONE:
        raise ValueError(f"growth: a run ended with fault {FaultCode(int(run[1])).name}.")


def _on_particles(meter: _Meter, scene: Scene, model, state) -> dict[str, Any]:
    """Step, list and right-hand side of a full or reduced model."""
    set_up, particles = measure.peak_memory_gib(), len(scene.state.position)
    dt = jnp.asarray(scene.time_step)
    run = partial(_run_of, steps=_STEPS)
    _good(meter.first(STEP, run, model, state, dt, steps=_STEPS))  # its peak holds no other list
    neighbors = meter.first(LIST, lambda m, s: m.prepare(s), model, state)
    meter.first(RATES, lambda m, s, n: m.rates(0.0 * dt, s, n), model, state, neighbors)
    return {
        "set_up_gib": set_up,
        "particles": particles,
        "neighbors": measure.interacting_pairs(scene.state.position, scene.space) / particles,
        "list_capacity": model.search.capacity,
        "run_capacity": model.search.run_capacity,
        "cells": model.search.grid.cells,
    }


def _full(case: Case, meter: _Meter) -> dict[str, Any]:
    scene = _scene(case)
    return _on_particles(meter, scene, scene.model(), scene.state)


def _moving(case: Case, meter: _Meter) -> dict[str, Any]:
    scene = _scene(case)
    points = np.asarray(Lattice().positions(scene.space))
    basis = fourier_basis(scene, points, case.modes)
    splines = LocalSplines.fit(points, basis.functions.reshape(len(points), -1), scene.space)
    model = ReducedModel.of_scene(scene, basis, splines, Galerkin())
    state = jax.jit(lambda m, s: m.project(s))(model, scene.state)
    return _on_particles(meter, scene, model, state)


def fourier_basis(scene: Scene, points: np.ndarray, modes: int) -> Basis:
    """Solenoidal modes on a lattice, orthonormal in the energy product.

        u_k = sqrt(2 / G) (-k_2, k_1) / |k| sin(2 pi k . x),    rho_k = 0,

    for the shortest whole k, one of each pair k and -k. The cost of a reduced model does not depend
    on what its modes are; these make the vortex itself.
    """
    reach = range(-modes, modes + 1)
    half = [k for k in product(reach, reach) if k > (0, 0)]
    vectors = np.array(sorted(half, key=lambda k: (k[0] ** 2 + k[1] ** 2, k))[:modes])
    across = np.stack([-vectors[:, 1], vectors[:, 0]]) / np.linalg.norm(vectors, axis=1)
    waves = np.sin(2.0 * np.pi * points @ vectors.T) * np.sqrt(2.0 / len(points))
    values = np.zeros((len(points), 3, modes))
    values[:, 1:] = across[None] * waves[:, None, :]
    centre = np.array([[float(scene.fluid.reference_density), 0.0, 0.0]])
    return Basis(values, centre, np.asarray(Energy().weights(scene.fluid, 2)), np.ones(modes))


def _tensors(case: Case, meter: _Meter) -> dict[str, Any]:
    """A decaying system of random tensors: what stands in them does not change the cost."""
    size = case.modes
    quadratic = np.random.default_rng(0).standard_normal((size, size, size)) / size**1.5
    linear = np.stack([-np.eye(size), np.zeros((size, size))])
    system = QuadraticSystem(jnp.zeros((2, size)), jnp.asarray(linear), jnp.asarray(quadratic))
    model, state = PointsModel(system, jnp.asarray(1.0 / REYNOLDS)), jnp.full(size, 0.01)
    run, dt = partial(_run_of, steps=_TENSOR_STEPS), jnp.asarray(1e-3)
    _good(meter.first(STEP, run, model, state, dt, steps=_TENSOR_STEPS))
    return {}


def _gradient(case: Case, meter: _Meter) -> dict[str, Any]:
    """The final kinetic energy and its gradient in all parameters and the initial state."""
    scene = _scene(case)
    model, dt = scene.model(), jnp.asarray(scene.time_step)

    def final(model, state):
        state, code = _run_of(model, state, dt, case.steps)
        return kinetic_energy(state.velocity, model.functional.mass), code

    _good(meter.first(RUN, final, model, scene.state))
    slopes = jax.value_and_grad(final, argnums=(0, 1), has_aux=True)
    _, found = meter.first(GRADIENT, slopes, model, scene.state)
    if not all(bool(jnp.all(jnp.isfinite(leaf))) for leaf in jax.tree.leaves(found)):
        raise ValueError("growth: a gradient is not finite.")
    return {"list_capacity": model.search.capacity}


_FAMILIES = {FULL: _full, MOVING: _moving, TENSORS: _tensors, GRADIENT: _gradient}
_FAMILIES |= {NEIGHBORS: _full, MOVING_MODES: _moving}


def growth(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Slope of each curve, log y over log x by least squares, and how far it is from a line.

    `deviation_percent` is the largest change of y / x, with its sign, from what it is at the least
    x. With particles, both are of sizes from 10^4 to 10^6 where there are two such.
    """
    found = []
    programs = dict.fromkeys((r["case"]["family"], name) for r in rows for name in r["programs"])
    for (family, program), quantity in product(programs, QUANTITIES):
        x, y = curve(rows, family, program, quantity)
        claimed = (x >= CLAIMED[0]) & (x <= CLAIMED[1])
        if ALONG[family] == "particles" and claimed.sum() > 1:
            x, y = x[claimed], y[claimed]
        of_step = quantity == "peak memory" and program in (LIST, RATES)  # the step came first
        if len(x) < 2 or not (y > 0.0).all() or of_step:
            continue
        change = y / x / (y[0] / x[0]) - 1.0
        found.append({
            "family": family, "program": program, "quantity": quantity, "along": ALONG[family],
            "from": float(x[0]), "to": float(x[-1]),
            "slope": float(np.polyfit(np.log(x), np.log(y), 1)[0]),
            "deviation_percent": 100.0 * float(change[np.argmax(np.abs(change))]),
        })  # fmt: skip
    return found


def _abscissa(row: dict[str, Any]) -> float:
    return float((row["case"] | row)[ALONG[row["case"]["family"]]])


def curve(rows: list[dict[str, Any]], family: str, program: str, quantity: str):
    """What a family's cost is measured against, and a quantity of one of its programs."""
    rows = sorted((r for r in rows if r["case"]["family"] == family), key=_abscissa)
    found = [QUANTITIES[quantity](row, row["programs"][program]) for row in rows]
    return np.array([*map(_abscissa, rows)]), np.array(found)


def figure(results: dict[str, Any], path: Path) -> Path:
    """Time and memory in six panels, the fitted slope beside each curve."""
    made, handles = style.sheet(12, 7), {}
    panels = zip(made.subplots(2, 3).flat, PANELS, strict=True)
    for axes, (quantity, xlabel, ylabel, families) in panels:
        style.dress(axes, xlabel, ylabel)
        axes.set_xscale("log", base=10 if xlabel == "particles" else 2)
        axes.set(yscale="log", xmargin=0.16)
        for one in results["growth"]:
            family, program = one["family"], one["program"]
            key = families.get(family), program
            if key not in CURVES or one["quantity"] != quantity:
                continue
            label, color, marker = CURVES[key]
            x, y = curve(results["rows"], family, program, quantity)
            look = {"color": color, "marker": marker, "linewidth": 1.2, "markersize": 5}
            (handles[label],) = axes.plot(x, y, label=label, **look)
            beside = {"xytext": (6, -3), "textcoords": "offset points", "fontsize": style.SMALL}
            axes.annotate(f"{one['slope']:.2f}", (x[-1], y[-1]), color=color, **beside)
        axes.xaxis.set_major_formatter("{x:.7g}")
        if quantity == "peak memory":
            handles[LIMIT] = axes.axhline(LIMIT, color=style.INK, linestyle=":", label="16 GiB")
    style.legend_below(made, list(handles.values()))
    return style.save(made, path)


def _table(results: dict[str, Any]) -> str:
    number = measure.number
    rows = [
        (
            row["case"]["family"], f"{_abscissa(row):.7g}", name,
            *(number(1e3 * program[key], 4) for key in ("median", "spread", "processor")),
            *(number(program.get(k)) for k in ("compile_seconds", "peak_gib", "temp_gib")),
        )
        for row in sorted(results["rows"], key=lambda r: (r["case"]["family"], _abscissa(r)))
        for name, program in row["programs"].items()
    ]  # fmt: skip
    header = ("family", "at", "program", "ms", "spread", "processor", "compile s", "GiB", "temp")
    slopes = [
        (g["family"], g["program"], g["quantity"], f"{g['from']:.7g} to {g['to']:.7g} {g['along']}",
         f"{g['slope']:.3f}", f"{g['deviation_percent']:+.1f}")
        for g in results["growth"]
    ]  # fmt: skip
    below = ("family", "program", "quantity", "range", "slope", "off a line [%]")
    return f"{measure.format_rows(header, rows)}\n\n{measure.format_rows(below, slopes)}"


if __name__ == "__main__":
    raise SystemExit(main())
