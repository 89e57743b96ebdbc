"""Reduced models on points of both schemes: errors beside floors, and the full model's own sound.

    python -m benchmarks.scheme_models

The Taylor-Green vortex and the lid-driven cavity, trained at three Reynolds numbers and judged on
the centre line at two that nothing was trained on, against the full model of the same scheme. The
sound is what is left of the full model's pressure on that line once a mean over a tenth of a second
is taken out. Finished rows stand in the JSON file: the same command goes on.
"""

from __future__ import annotations

from functools import partial
from itertools import product
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy.ndimage import uniform_filter1d

import jaxsph_rom
from jaxsph import run_scene
from jaxsph.cli import positive_float, positive_int
from jaxsph.environment import environment
from jaxsph.metrics import centre_line, probe
from jaxsph.scenes import lid_driven_cavity, taylor_green
from jaxsph_rom import LinearClosure
from jaxsph_rom.points import mapped_run

from .both_schemes import SCHEMES
from .measure import format_rows, number, progress, tell
from .reduced_vortex import discrepancies
from .table import Table, command

SCENES = {"taylor-green": taylor_green, "lid-driven-cavity": lid_driven_cavity}
CLOSURES = {"none": None, "linear": LinearClosure()}
KEY = ("scene", "scheme", "modes", "closure", "reynolds")
_TRAINED_ON = (100.0, 150.0, 250.0)
_UNSEEN = (125.0, 200.0)
_SOUND = 0.1  # [s] that the mean is taken over


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a full run failed, 2: bad input."""
    return command("scheme_models", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--resolution", type=positive_int, default=32, metavar="N", help="default: 32")
    add("--end-time", type=positive_float, default=2.0, metavar="T", help="[s] (default: 2)")
    add("--modes", type=positive_int, nargs="+", default=[5, 10, 20], metavar="M",
        help="default: 5 10 20")  # fmt: skip


def _run(options) -> None:
    settings = {"resolution": options.resolution, "end_time": options.end_time}
    kept = Table(options.json, KEY, settings)
    kept.results |= {"environment": environment(), "device": jax.devices()[0].device_kind}
    for name, scheme in product(SCENES, SCHEMES):
        wanted = list(product(options.modes, CLOSURES, _UNSEEN))
        if all(kept.has((name, scheme, *row)) for row in wanted):
            tell(f"done before: {name}, {scheme}")
            continue
        make = partial(_scene, name, scheme, settings)
        runs = {}
        for reynolds in (*_TRAINED_ON, *_UNSEEN):
            scene = make(reynolds=reynolds)
            with progress(f"{name}, {scheme}, Re {reynolds:g}", scene.steps) as report:
                runs[reynolds] = run_scene(scene, progress=report)
        for modes, closure in product(options.modes, CLOSURES):
            trained = jaxsph_rom.train(
                make,
                [{"reynolds": reynolds} for reynolds in _TRAINED_ON],
                modes,
                runs=[runs[reynolds] for reynolds in _TRAINED_ON],
                closure=CLOSURES[closure],
            )
            for reynolds in _UNSEEN:
                row = dict(zip(KEY, (name, scheme, modes, closure, reynolds), strict=True))
                kept.add(row | _judged(trained, make(reynolds=reynolds), runs[reynolds]))
    print(_table(kept.rows))


def _scene(name: str, scheme: str, settings, reynolds: float):
    return SCENES[name](
        settings["resolution"],
        reynolds,
        end_time=settings["end_time"],
        scheme=SCHEMES[scheme],
        dtype="float64",
    )


def _judged(trained, scene, full) -> dict[str, Any]:
    """Errors on the centre line, floors and sound, of a run at one Reynolds number."""
    flow, line = trained.flow, centre_line(scene.space)
    truth = probe(full, line, scene.space)
    prediction = trained.predict({"reynolds": scene.parameters["reynolds"]})
    projected = np.asarray(flow.project(mapped_run(flow.reference, full, scene.fluid)))

    def profile(coordinates):
        fields = flow.fields(jnp.asarray(coordinates), full.time, line)
        return np.linalg.norm(fields.velocity, axis=2), np.asarray(fields.pressure)

    stable = int(prediction.status[0]) == 0
    row = {
        "stable": stable,
        "sound_percent": _sound(truth[1], full.time[1] - full.time[0]),
        "full_seconds": full.metadata["run_seconds"],
        "reduced_seconds": prediction.run_seconds,
    }
    row |= discrepancies("floor_", truth, profile(projected))
    return row | discrepancies("", truth, profile(prediction.coordinates[0])) if stable else row


def _sound(pressure: np.ndarray, interval: float) -> float:
    """Root mean square of what a running mean leaves of a pressure, over its range [%]."""
    width = max(int(round(_SOUND / interval)), 3)
    waves = (pressure - uniform_filter1d(pressure, width, axis=0))[width:-width]
    return float(100.0 * np.sqrt(np.mean(waves**2)) / np.ptp(pressure[width:-width]))


def _table(rows: list[dict[str, Any]]) -> str:
    header = (*KEY, "velocity % peak", "median", "floor", "pressure % peak", "median", "floor",
              "sound %", "full s", "reduced ms")  # fmt: skip
    names = [
        f"{floor}{kind}_{over}_percent"
        for kind in ("velocity", "pressure")
        for floor, over in (("", "peak"), ("", "median"), ("floor_", "median"))
    ]
    return format_rows(header, [
        (
            *(f"{row[name]:g}" if isinstance(row[name], float) else str(row[name]) for name in KEY),
            *(number(row.get(name)) for name in (*names, "sound_percent", "full_seconds")),
            number(1e3 * row["reduced_seconds"]),
        )
        for row in rows
    ])  # fmt: skip


if __name__ == "__main__":
    raise SystemExit(main())
