"""Cumulative energy of POD modes of a Taylor-Green run, in Lagrangian and in reference space.

`python -m benchmarks.cumulative_energy --scale half --out DIR --json FILE` takes the full run that
is in `DIR/full` or makes it.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import jax

from benchmarks.measure import format_rows, tell, write_json
from jaxsph.environment import environment
from jaxsph.scenes import taylor_green
from jaxsph_rom import Experiment, Study, cumulative_energy

MODES = (2, 5, 10)
PAPER = {"lagrangian": (99.9, 99.98, 99.995), "reference": (99.996, 99.999, 99.9994)}


def main(argv: list[str] | None = None) -> int:
    """Print the table and write the JSON file."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--scale", default="half", choices=("small", "half", "paper"))
    parser.add_argument("--reynolds", type=float, default=100.0)
    parser.add_argument("--out", type=Path, required=True, help="folder of the full run")
    parser.add_argument("--json", type=Path, required=True)
    options = parser.parse_args(argv)
    with jax.enable_x64(True):
        study = Study(
            lambda reynolds: taylor_green(None, reynolds, scale=options.scale), options.out
        )
        experiment = Experiment((options.reynolds,), (options.reynolds,), (max(MODES),))
        tell("full run, then two singular value decompositions")
        bases = {
            "lagrangian": study.lagrangian_basis(experiment, max(MODES)),
            "reference": study.basis(experiment, max(MODES)),
        }
        results = {"parameters": study.scene(options.reynolds).parameters, "spaces": {}}
        for name, basis in bases.items():
            energy = cumulative_energy(basis.singular_values)
            results["spaces"][name] = {
                "percent": {str(m): float(energy[m - 1]) for m in MODES},
                "paper_percent": dict(zip(map(str, MODES), PAPER[name], strict=True)),
            }
        run = study.full(options.reynolds).metadata
        results["full_run"] = {k: run.get(k) for k in ("steps", "run_seconds", "compile_seconds")}
    write_json(options.json, {**results, "environment": environment()})
    rows = [
        (name, str(m), f"{space['percent'][str(m)]:.4f}", f"{space['paper_percent'][str(m)]:g}")
        for name, space in results["spaces"].items()
        for m in MODES
    ]
    print(format_rows(("space", "modes", "energy %", "paper %"), rows))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
