"""`jaxsph show PATH`: a quick look at a run, whether it has ended or not, or at a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from jaxsph_command.errors import Parser

from ..history import energy_unit, read_history
from ..io import Overview, check_target, read_box, read_overview, read_snapshot, read_walls_of
from ..io.trajectory_file import FORMAT
from ..metrics import kinetic_energy
from ..report.body_rows import body_rows
from ..report.force_rows import force_rows
from ..report.settings import scene_rows
from .options import add_json_option, bytes_told, print_rows, write_json
from .show_contents import contents, file_format
from .show_folder import folder_contents
from .show_other import other_contents

_SAMPLES = 20  # snapshots that are read of a long run, beside the last one


def add_to(parser: Parser, words: list[str]) -> None:
    """Add the command's options to its parser."""
    parser.description = (
        "Tell what a trajectory file holds: the scene, how far the run has come, and "
        "what its particles do. The file may still be written. Of other files that commands leave, "
        "sweeps, models, predictions, options, results, pages and pictures, tell what is in them. "
        "Of a folder, tell what each file in it is and how to look at it."
    )
    parser.set_defaults(command=_show)
    add = parser.add_argument
    add("file", type=Path, metavar="FILE", help="trajectory.h5 of a run, another file, or "
        "a folder")  # fmt: skip
    add("--figure", type=Path, metavar="FILE", help="draw the last snapshot (.png, .pdf or .svg)")
    add_json_option(parser)


def _show(options) -> int:
    if options.figure is not None:
        check_target(options.figure)
    rows = _contents(options.file)
    if rows is not None:
        if options.figure is not None:
            raise ValueError(f"--figure: {options.file} is no run, so there is nothing to draw.")
        if not options.file.is_dir():
            rows = {"file": f"{options.file}, {bytes_told(options.file.stat().st_size)}", **rows}
        print_rows(rows)
        write_json(options.json, rows)
        return 0
    overview = read_overview(options.file)
    measures = measures_of(options.file, overview)
    rows = {"file": f"{options.file}, {bytes_told(overview.size)}", **rows_of(overview, measures)}
    if options.figure is not None:
        from ..plotting import save, snapshot_figure  # matplotlib takes its time to load

        time, snapshot = read_snapshot(options.file)
        walls = read_walls_of(options.file, snapshot)
        drawn = snapshot_figure(time, snapshot, walls=walls, box=read_box(options.file))
        save(drawn, options.figure)
        rows["figure"] = str(options.figure)
    print_rows(rows)
    if options.json is not None:
        shown = {**vars(overview), **vars(overview.schedule), "steps": overview.schedule.steps}
        del shown["schedule"]
        write_json(options.json, {**shown, **measures})
    return 0


def _contents(path: Path) -> dict[str, str] | None:
    """What is in a folder or a file that is no run; None for a run."""
    if path.is_dir():
        return folder_contents(path)
    rows = other_contents(path)
    if rows is None and file_format(path) not in (None, FORMAT):
        return contents(path)
    return rows


def measures_of(path: Path, overview: Overview) -> dict[str, Any]:
    """Energies, densities and speeds, JSON-like; of a long run, those of some snapshots."""
    if not overview.snapshots:
        return {}
    every = max(1, overview.snapshots // _SAMPLES)
    mass = overview.mass or float("nan")
    history = read_history(path, overview.particles, mass, every)
    _, last = read_snapshot(path, overview.snapshots - 1)
    last = last.in_flow()
    measures = {
        "lowest_density": min(float(history.lowest_density.min()), float(last.density.min())),
        "highest_density": max(float(history.highest_density.max()), float(last.density.max())),
        "highest_speed": max(
            float(history.highest_speed.max()), float((last.velocity**2).sum(axis=1).max() ** 0.5)
        ),
        "snapshots_read": len(history.time) + int((overview.snapshots - 1) % every > 0),
    }
    if overview.mass is not None:
        measures["kinetic_energy_first"] = float(history.kinetic_energy[0])
        measures["kinetic_energy_last"] = float(kinetic_energy(last.velocity, mass))
    return measures


def rows_of(overview: Overview, measures: dict[str, Any]) -> dict[str, str]:
    """What a run is, how far it has come and what its particles do, as people read it."""
    rows = scene_rows(overview)
    done = f"{max(0, overview.step)} of {overview.schedule.steps} steps"
    rows["progress"] = f"complete, {done}" if overview.complete else (
        f"{done}; still being written, or cut short and to go on with --resume"
    )  # fmt: skip
    rows["time"] = f"{overview.snapshots} snapshots from 0 to {overview.time:g} s"
    if measures:
        some = f"over {measures['snapshots_read']} of {overview.snapshots} snapshots"
        if "kinetic_energy_first" in measures:
            first, last = (measures[f"kinetic_energy_{name}"] for name in ("first", "last"))
            unit = energy_unit(overview.dim)
            rows["kinetic energy"] = f"{first:.5g} {unit} at first, {last:.5g} {unit} at last"
        low, high = measures["lowest_density"], measures["highest_density"]
        rows["density"] = f"{low:.5g} to {high:.5g} kg/m^3 ({some})"
        rows["largest speed"] = f"{measures['highest_speed']:.4g} m/s ({some})"
    rows |= force_rows(overview)
    rows |= body_rows(overview)
    if "run_seconds" in overview.metadata:
        rows["run"] = f"{overview.metadata['run_seconds']:.3g} s"
    rows["versions"] = ", ".join(f"{name} {text}" for name, text in overview.versions.items())
    return rows

