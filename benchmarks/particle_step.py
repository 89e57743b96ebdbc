"""What a step of the reduced model on moving particles costs, beside one of its full model.

    python -m benchmarks.particle_step
    python -m benchmarks.particle_step --scenes taylor-green --modes 5 50 --interpolations splines

The modes are of a short run, in the consistent scheme, from a lattice; the interval that is timed
is compiled as `simulate` does. All models of a scene take turns, so that they see the same load;
times are of the process and on the clock, and medians.
"""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import Schedule, simulate
from jaxsph.arrangements import Lattice
from jaxsph.cli import positive_int
from jaxsph.environment import environment
from jaxsph.integrate import FaultCode, integrate
from jaxsph.interpolation import QuadraticMap
from jaxsph.scenes import SCENES
from jaxsph_rom import Energy, ReducedModel, ReferenceSpace, pod

from .measure import alternate, compiled, format_rows, number, summary
from .particle_models import INTERPOLATIONS, PROJECTIONS
from .table import Table, command

KEY = ("scene", "resolution", "interpolation", "modes", "projection")
_STEPS = 10  # timed at once, with one list made at their start
_RUN = 60  # steps of the run that modes are of


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a model failed, 2: bad input."""
    return command("particle_step", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    scenes = ("taylor-green", "lid-driven-cavity")
    add("--scenes", choices=scenes, nargs="+", default=list(scenes), help="default: both")
    add("--resolution", type=positive_int, default=50, metavar="N", help="default: %(default)s")
    add("--interpolations", choices=tuple(INTERPOLATIONS), nargs="+", default=["polynomials"],
        help="of modes at moving particles (default: polynomials)")  # fmt: skip
    add("--modes", type=positive_int, nargs="+", default=[20], metavar="M", help="default: 20")
    add("--projections", choices=tuple(PROJECTIONS), nargs="+", default=list(PROJECTIONS),
        help="default: all")  # fmt: skip
    add("--repeats", type=positive_int, default=15, metavar="K", help="default: %(default)s")


def _run(options) -> None:
    kept = Table(options.json, KEY)
    kept.results |= {"environment": environment(), "device": jax.devices()[0].device_kind}
    for name in options.scenes:
        for row in _rows(name, options):
            kept.rows[:] = [r for r in kept.rows if any(r[k] != row[k] for k in KEY)]
            kept.add(row)
    print(_table(kept.rows))


def _rows(name: str, options) -> list[dict[str, Any]]:
    """A row for each reduced model of a scene, all timed in turn with the full model."""
    scene = SCENES[name](options.resolution, arrangement=Lattice(), dtype="float64")
    state, time_step = scene.state, scene.time_step
    run = simulate(scene.model(), state, Schedule(time_step, 1, max(_RUN, max(options.modes))))
    reference = ReferenceSpace(state.position, scene.space, QuadraticMap)
    basis = pod(reference.snapshots(run), Energy(), scene.fluid, max(options.modes))
    calls, cases = {"full": _interval(scene.model(), state, time_step)}, {}
    for kind in options.interpolations:
        for modes in options.modes:
            part = basis.truncated(modes)
            values = part.functions.reshape(len(part.modes), -1)
            points = np.asarray(state.position)
            functions = INTERPOLATIONS[kind].fit(points, values, scene.space)
            for word in options.projections:
                model = ReducedModel.of_scene(scene, part, functions, PROJECTIONS[word])
                case = f"{kind} {modes} {word}"
                start = jax.jit(ReducedModel.project)(model, state)
                calls[case] = _interval(model, start, time_step)
                cases[case] = {"interpolation": kind, "modes": modes, "projection": word}
    wall, busy = alternate(calls, options.repeats)
    rows = []
    for case, told in cases.items():
        row = {"scene": name, "resolution": options.resolution, "particles": len(state.position)}
        row |= told
        for label, times in (("", wall), ("process_", busy)):
            found = {key: summary([t / _STEPS for t in times[key]]) for key in ("full", case)}
            row[f"{label}seconds"], row[f"full_{label}seconds"] = found[case], found["full"]
            row[f"{label}ratio"] = found[case]["median"] / found["full"]["median"]
        rows.append(row)
    return rows


def _interval(model, state, time_step: float):
    """A call that makes the timed steps.

    Raises:
        ValueError: if the model is lost in them.
    """

    def steps(model, state):
        first, dt = jnp.zeros((), jnp.int32), jnp.asarray(time_step, state.position.dtype)
        state, fault, _, _ = integrate(model, state, first, dt, _STEPS, 1)
        return state, fault

    call, _ = compiled(steps, model, state)
    code = int(call()[1].code)
    if code != FaultCode.NONE:
        raise ValueError(f"modes: the timed steps end in {FaultCode(code).name}; take others.")
    return call


def _table(rows: list[dict[str, Any]]) -> str:
    header = ("scene", "particles", "interpolation", "M", "projection", "full [ms]", "reduced [ms]",
              "ratio", "on the clock")  # fmt: skip
    return "a step; times of the process\n" + format_rows(
        header,
        [
            (
                row["scene"], str(row["particles"]), row["interpolation"], str(row["modes"]),
                row["projection"], number(1e3 * row["full_process_seconds"]["median"]),
                number(1e3 * row["process_seconds"]["median"]), number(row["process_ratio"]),
                number(row["ratio"]),
            )
            for row in rows
        ],
    )  # fmt: skip


if __name__ == "__main__":
    raise SystemExit(main())
