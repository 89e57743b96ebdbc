"""Gradients through time: against central differences, and what they cost in time and memory.

    python -m benchmarks.gradients

A scalar of the final state, sum (1 + sin 0.7 i) |u_i|^2, after 200 steps of the Taylor-Green vortex
(2,025 particles, the neighbour list rebuilt on the way), of the lid-driven cavity, and of a reduced
model of the vortex on moving particles: its derivatives in the viscosity (relative), in the
amplitude of a velocity field at the start, and in the positions at the start along a random
direction. Central differences are of fourth order, at several steps; the best of each is what
stands in the table, all are in the file. Then run time, and memory of the compiled programs, by
number of steps. What is in the file already is not done again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import COMPILER_OPTIONS, run_scene
from jaxsph.arrangements import JitteredLattice, Lattice
from jaxsph.cli import positive_int
from jaxsph.environment import environment
from jaxsph.integrate import FaultCode, integrate
from jaxsph.scenes import Scene, lid_driven_cavity, taylor_green
from jaxsph.schemes import DeltaPlus
from jaxsph_rom import (
    ConsistentAdvection,
    Energy,
    Galerkin,
    LocalSplines,
    ReducedModel,
    ReducedState,
    ReferenceSpace,
    pod,
)

from .measure import (
    alternate,
    format_rows,
    number,
    progress,
    summary,
    tell,
)
from .table import Table, command

PARAMETERS = ("viscosity", "velocity amplitude", "positions")
DIFFERENCES = (1e-4, 1e-5, 1e-6, 1e-7)  # the parameters are of order one
_BASE = (1.0, 1.0, 0.0)
_MODES, _TRAINING_TIME = 5, 0.75  # s, longer than the runs that are differentiated
_REDUCED_STEPS = 50  # after 200 its particles have clumped: no difference resolves the slope
_MARGIN = 1.6  # of the list of the reduced model, whose particles come nearer to one another


@dataclass(frozen=True)
class Flow:
    """A run as a function of three parameters.

    Args:
        name: of the case.
        scene: it comes from.
        start: of a model and parameters (3,), the model and state that the run starts from.
        model: to run.
    """

    name: str
    scene: Scene
    start: Callable
    model: Any

    def final(self, parameters, steps: int, checkpoints: int | None = None):
        """The scalar of the final state, and the fault's code."""
        model, state = self.start(self.model, parameters)
        step = jnp.asarray(self.scene.time_step)
        state, fault, _, _ = integrate(
            model, state, jnp.zeros((), jnp.int32), step, steps, 1, checkpoints=checkpoints
        )
        velocity = model.observe(state).velocity
        weight = 1.0 + jnp.sin(0.7 * jnp.arange(len(velocity), dtype=velocity.dtype))
        return jnp.sum(weight * jnp.sum(velocity**2, axis=1)), fault.code


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("gradients", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--side", type=positive_int, default=45, metavar="N", help="default: %(default)s")
    add("--steps", type=positive_int, default=200, metavar="K", help="default: %(default)s")
    add("--cost-steps", type=positive_int, nargs="+", default=[100, 200, 1000], metavar="K",
        help="runs whose cost is measured (default: 100 200 1000)")  # fmt: skip
    add("--repeats", type=positive_int, default=3, metavar="K", help="default: %(default)s")


def _run(options) -> None:
    settings = {"side": options.side, "steps": options.steps}
    kept = Table(options.json, settings=settings, beside=_beside, rows="accuracy")
    costs = kept.results.setdefault("cost", [])
    shorter = min(options.steps, _REDUCED_STEPS)
    runs = ((periodic, options.steps), (walled, options.steps), (reduced, shorter))
    for make, steps in runs[len(kept.rows) :]:
        kept.add(accuracy(make(options.side), steps))
    for steps in options.cost_steps[len(costs) :]:
        costs.append(cost(periodic(options.side), steps, options.repeats))
        kept.write()
    print(_table(kept.results))


def _beside(rows) -> dict[str, Any]:
    return {"environment": environment()}


def periodic(side: int) -> Flow:
    """The Taylor-Green vortex."""
    scene = taylor_green(
        side, 100.0, arrangement=JitteredLattice(seed=1), scheme=DeltaPlus()
    )
    start = partial(_full_start, scene, scene.state.velocity)
    return Flow("taylor-green", scene, start, scene.model())


def walled(side: int) -> Flow:
    """The lid-driven cavity; the velocity field at the start is one vortex."""
    scene = lid_driven_cavity(side, 100.0, arrangement=Lattice(), scheme=DeltaPlus())
    x, y = np.pi * scene.state.position.T
    vortex = jnp.stack([jnp.sin(x) * jnp.cos(y), -jnp.cos(x) * jnp.sin(y)], axis=1)
    return Flow("lid-driven-cavity", scene, partial(_full_start, scene, vortex), scene.model())


def reduced(side: int) -> Flow:
    """A reduced model of the vortex on moving particles, M = 5."""
    scene = taylor_green(
        side, 100.0, end_time=_TRAINING_TIME, arrangement=Lattice(), scheme=DeltaPlus()
    )
    points = scene.state.position
    snapshots = ReferenceSpace(points, scene.space).snapshots(run_scene(scene))
    basis = pod(snapshots, Energy(), scene.fluid, _MODES)
    values = basis.functions.reshape(len(points), -1)
    splines = LocalSplines.fit(np.asarray(points), values, scene.space, 3)
    model = ReducedModel.of_scene(scene, basis, splines, Galerkin(), ConsistentAdvection(), _MARGIN)
    coordinates = jax.jit(lambda m, s: m.project(s))(model, scene.state).coordinates

    def start(model, parameters):
        viscosity, amplitude, moved = parameters
        position = points + moved * _direction(scene)
        return _viscous(model, viscosity), ReducedState(amplitude * coordinates, position)

    return Flow("reduced taylor-green", scene, start, model)


def _full_start(scene: Scene, field, model, parameters):
    viscosity, amplitude, moved = parameters
    state = scene.state
    state = eqx.tree_at(
        lambda s: (s.velocity, s.position),
        state,
        (state.velocity + (amplitude - 1.0) * field, state.position + moved * _direction(scene)),
    )
    return _viscous(model, viscosity), state


def _direction(scene: Scene):
    """A random displacement of every particle, a spacing in size."""
    noise = np.random.default_rng(0).standard_normal(scene.state.position.shape)
    return jnp.asarray(noise * scene.space.spacing)


def _viscous(model, factor):
    """The model with its viscosity times a factor."""

    def leaf(model):
        return next(e for e in model.functional.effects if hasattr(e, "viscosity")).viscosity

    return eqx.tree_at(leaf, model, leaf(model) * factor)


def accuracy(flow: Flow, steps: int) -> dict[str, Any]:
    """Derivatives in all parameters by reverse and by forward mode, and by central differences."""
    base = jnp.asarray(_BASE)
    run = jax.jit(partial(flow.final, steps=steps))
    slopes, code = jax.jit(jax.grad(partial(flow.final, steps=steps), has_aux=True))(base)
    if int(code) != int(FaultCode.NONE):
        raise ValueError(f"{flow.name}: the run met fault {int(code)}; take fewer steps.")
    forward = jax.jit(
        lambda along: jax.jvp(lambda p: flow.final(p, steps)[0], (base,), (along,))[1]
    )
    rows = []
    with progress(flow.name, len(PARAMETERS) * len(DIFFERENCES)) as report:
        for index, name in enumerate(PARAMETERS):
            unit = jnp.zeros(len(_BASE)).at[index].set(1.0)
            found = {}
            for step in DIFFERENCES:
                far, near, back, behind = (
                    float(run(base + k * step * unit)[0]) for k in (2, 1, -1, -2)
                )
                found[step] = (8.0 * (near - back) - (far - behind)) / (12.0 * step)
                report(1)
            slope = float(slopes[index])
            errors = {str(step): abs(d / slope - 1.0) for step, d in found.items()}
            rows.append(
                {
                    "parameter": name,
                    "reverse": slope,
                    "forward_deviation": abs(float(forward(unit)) / slope - 1.0),
                    "deviation_by_difference": errors,
                    "deviation": min(errors.values()),
                }
            )
    particles = flow.scene.state.density.shape[0]
    return {"case": flow.name, "particles": particles, "steps": steps, "rows": rows}


def cost(flow: Flow, steps: int, repeats: int) -> dict[str, Any]:
    """Run time and memory of the run and of its gradient, compiled."""
    base = jnp.asarray(_BASE)
    row: dict[str, Any] = {"steps": steps}
    calls = {}
    for name, function in {
        "run": partial(flow.final, steps=steps),
        "gradient": jax.grad(partial(flow.final, steps=steps), has_aux=True),
    }.items():
        program = jax.jit(function).lower(base).compile(COMPILER_OPTIONS)
        memory = program.memory_analysis()
        row[f"{name}_mebibytes"] = memory.temp_size_in_bytes / 2**20
        calls[name] = partial(lambda p: jax.block_until_ready(p(base)), program)
    tell(f"{steps} steps: {row['gradient_mebibytes']:.0f} MiB")
    wall, _ = alternate(calls, repeats)
    times = {name: summary(seconds) for name, seconds in wall.items()}
    return row | {"seconds": times, "ratio": times["gradient"]["median"] / times["run"]["median"]}


def _table(results: dict[str, Any]) -> str:
    accuracy = [
        (case["case"], row["parameter"], number(row["reverse"], 6), number(row["deviation"], 2),
         number(row["forward_deviation"], 2))
        for case in results["accuracy"] for row in case["rows"]
    ]  # fmt: skip
    cost = [
        (str(row["steps"]), number(row["seconds"]["run"]["median"]),
         number(row["seconds"]["gradient"]["median"]), number(row["ratio"]),
         number(row["run_mebibytes"]), number(row["gradient_mebibytes"]))
        for row in results["cost"]
    ]  # fmt: skip
    return "\n\n".join(
        [
            format_rows(("case", "in", "derivative", "off differences", "off forward"), accuracy),
            format_rows(("steps", "run s", "gradient s", "ratio", "run MiB", "gradient MiB"), cost),
        ]
    )


if __name__ == "__main__":
    raise SystemExit(main())
