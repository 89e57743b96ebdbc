"""`jaxsph show`, `export` and `animate`: what they print and write, and how they say no."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import jaxsph
from jaxsph.arrangements import Lattice
from jaxsph.cli import main
from jaxsph.cli.animate import FIELDS
from jaxsph.cli.options import bytes_told
from jaxsph.io import TrajectoryWriter, read_trajectory
from jaxsph.plotting import FIELDS as DRAWN
from jaxsph.sweeps import sweep_file
from jaxsph.trajectory import Snapshot
from jaxsph_rom.cli import main as reduced_main
from jaxsph_rom.points.files.whole_file import write_whole
from tests.runs import random_run


@pytest.fixture(autouse=True)
def in_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def shown(capsys):
    """What was printed, by name."""
    return {line[:22].strip(): line[23:] for line in capsys.readouterr().out.splitlines()}


def test_show(tmp_path, capsys):
    run = read_trajectory(random_run("t.h5", finish=True))
    assert main(["show", "t.h5", "--json", "new/t.json"]) == 0
    rows = shown(capsys)
    assert rows["file"].startswith("t.h5, ") and rows["scene"] == "taylor-green"
    assert "AdjointPressure" in rows["effects"] and rows["reynolds"] == "100"
    assert rows["particles"] == "256, in 2 dimensions, float64"
    assert rows["progress"].startswith("complete, ") and rows["run"] == "1.5 s"
    assert rows["time"] == f"5 snapshots from 0 to {run.time[-1]:g} s"
    mass = 1000.0 / 256
    first, last = (0.5 * mass * (run.velocity[k] ** 2).sum() for k in (0, -1))
    assert rows["kinetic energy"] == f"{first:.5g} J/m at first, {last:.5g} J/m at last"
    low, high = run.density.min(), run.density.max()
    assert rows["density"] == f"{low:.5g} to {high:.5g} kg/m^3 (over 5 of 5 snapshots)"
    speed = np.linalg.norm(run.velocity, axis=2).max()
    assert rows["largest speed"] == f"{speed:.4g} m/s (over 5 of 5 snapshots)"
    assert f"jaxsph {jaxsph.__version__}" in rows["versions"]
    stored = json.loads((tmp_path / "new" / "t.json").read_text())
    assert stored["kinetic_energy_last"] == pytest.approx(last) and stored["complete"]


def test_show_of_a_run_that_goes_on(capsys):
    scene = jaxsph.scenes.taylor_green(16, arrangement=jaxsph.arrangements.Lattice())
    state = scene.state
    with TrajectoryWriter.create("t.h5", scene) as writer:
        assert main(["show", "t.h5"]) == 0
        rows = shown(capsys)
        assert rows["time"] == "0 snapshots from 0 to 0 s" and "density" not in rows
        assert main(["show", "t.h5", "--figure", "f.png"]) == 2
        assert "holds no snapshot yet" in capsys.readouterr().err
        for k in range(48):
            density = state.density + k
            fields = (state.position, state.velocity, density, density)
            writer.append(2 * k, 0.02 * k, Snapshot(*map(np.asarray, fields)))
        assert main(["show", "t.h5", "--figure", "new/f.png"]) == 0
    rows = shown(capsys)
    assert rows["progress"].startswith("94 of 100 steps; still being written, or cut short")
    highest = float(state.density.max()) + 47  # of the last one, which every second leaves out
    assert rows["density"].endswith(f" to {highest:.5g} kg/m^3 (over 25 of 48 snapshots)")
    with Image.open("new/f.png") as picture:
        assert picture.format == "PNG"


def test_show_compiles_nothing():
    random_run("t.h5")
    script = (
        "import jax, sys; from jaxsph.cli import main\n"
        "jax.monitoring.register_event_duration_secs_listener(\n"
        "    lambda name, *a, **k: sys.exit(name) if 'compile' in name else None)\n"
        "assert main(['show', 't.h5', '--figure', 'f.png']) == 0"
    )
    root = str(jaxsph.__path__[0]).rpartition("/")[0]
    done = subprocess.run(
        [sys.executable, "-c", script], env={"PYTHONPATH": root}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def test_show_of_other_files(capsys):
    scenes = [jaxsph.scenes.taylor_green(12, re, end_time=0.04, arrangement=Lattice())
              for re in (100.0, 200.0)]  # fmt: skip
    sweep_file.create("sweep.h5", scenes)
    assert main(["show", "sweep.h5", "--json", "new/sweep.json"]) == 0
    rows = shown(capsys)
    assert rows["holds"] == "jaxsph sweep, schema 1" and rows["scene"] == "taylor-green"
    assert rows["members"] == "2, 0 lost, 2 not run yet"
    assert rows["velocity"] == "2 x 3 x 144 x 2, float64 [m/s]"
    with open("new/sweep.json") as file:
        assert json.load(file)["members"] == rows["members"]
    layout, arrays = {"starts": ("runs modes", "coordinate")}, {"starts": np.ones((2, 3))}
    write_whole("m.h5", ("jaxsph reduced flow", 1), layout, arrays, {"scene": "couette"})
    assert main(["show", "m.h5"]) == 0
    rows = shown(capsys)
    assert rows["starts"] == "2 x 3, float64 [coordinate]" and rows["scene"] == "couette"
    assert main(["show", "m.h5", "--figure", "f.png"]) == 2
    random_run("t.h5")
    assert main(["export", "t.h5"]) == 0
    assert main(["show", "t.vtkhdf"]) == 0
    assert shown(capsys)["VTKHDF/Points"] == "1280 x 3, float64 [m]"


def test_show_of_what_a_run_leaves(capsys):
    run = "run taylor-green --resolution 12 --arrangement lattice --t-end 0.02 --out a"
    assert main([*run.split(), "--json", "a/r.json"]) == 0
    assert main(["animate", "a/trajectory.h5", "--every", "1"]) == 0
    assert main(["animate", "a/trajectory.h5", "--every", "9", "--out", "re_0.5"]) == 0
    assert Path("re_0.5/trajectory.gif").is_file()
    assert main(["show", "a/trajectory.h5", "--figure", "a/f.png"]) == 0
    capsys.readouterr()
    found = {}
    for name in ("run.toml", "r.json", "report.html", "trajectory.gif", "f.png"):
        assert main(["show", f"a/{name}", "--json", "shown.json"]) == 0
        found[name] = json.loads(Path("shown.json").read_text())
    assert found["run.toml"]["resolution"] == "12" and found["run.toml"]["command"] == "run"
    assert found["run.toml"]["run again by"] == "jaxsph run --config a/run.toml --out DIR"
    assert found["r.json"]["scene"] == "taylor-green" and found["r.json"]["particles"] == "144"
    error = json.loads(Path("a/r.json").read_text())["errors"]["velocity_relative_l2"]
    assert found["r.json"]["errors.velocity_relative_l2"] == f"{error:.6g}"
    assert found["r.json"]["versions.jaxsph"] == jaxsph.__version__
    assert "taylor-green" in found["report.html"]["title"]
    frames = len(read_trajectory("a/trajectory.h5").time)
    assert int(found["trajectory.gif"].get("frames", 1)) == frames > 1
    with Image.open("a/f.png") as picture:
        size = f"{picture.width} x {picture.height} pixels"
    assert found["f.png"]["size"] == size
    # every kind of file that is there can be shown
    for path in Path("a").iterdir():
        assert main(["show", str(path), "--json", "shown.json"]) == 0
    many = {"cases": [{"re": k, "errors": [0.5] * 40} for k in range(5)], "nothing": None}
    with open("many.json", "w") as file:
        json.dump(many, file)
    assert main(["show", "many.json"]) == 0
    rows = shown(capsys)
    assert rows["cases.0.re"] == "0" and rows["cases"] == "5 in all"
    assert rows["cases.2.errors"] == "40 values" and rows["nothing"] == "None"


def test_show_of_a_folder(capsys):
    Path("empty").mkdir()
    assert main(["show", "empty"]) == 2
    assert "empty folder" in capsys.readouterr().err
    random_run("a/full/re-100/t.h5", count=3)
    random_run("a/t.h5", finish=True)
    layout = {"starts": ("runs modes", "coordinate")}
    write_whole("a/m.h5", ("jaxsph reduced flow", 1), layout, {"starts": np.ones((2, 3))}, {})
    Path("a/run.toml").write_text("# jaxsph run --config run.toml --out DIR runs this again\n")
    Path("a/broken.toml").write_text("=")
    for name in ("notes.txt", "report.html", ".hidden"):
        Path("a", name).write_text("<title>x</title>")
    for program in (main, reduced_main):
        assert program(["show", "a", "--json", "shown.json"]) == 0
        rows = shown(capsys)
        assert list(rows) == ["broken.toml", "m.h5", "notes.txt", "report.html", "run.toml", "t.h5",
                              "full/"]  # fmt: skip
        assert json.loads(Path("shown.json").read_text()) == rows
    assert rows["run.toml"].endswith(": jaxsph run --config a/run.toml --out DIR")
    assert rows["broken.toml"] == "options of a command, 1 B"
    assert rows["t.h5"].startswith("a run of taylor-green, 5 snapshots, complete, ")
    assert rows["t.h5"].endswith(": jaxsph animate a/t.h5")
    assert rows["m.h5"].startswith("a reduced model, ")
    assert rows["m.h5"].endswith(": jaxsph-rom predict a/m.h5")
    assert rows["notes.txt"] == "not a file of this project, 16 B"
    assert rows["full/"].startswith("1 file, ") and rows["full/"].endswith(": jaxsph show a/full")
    Path("a/t.h5").write_bytes(Path("a/t.h5").read_bytes()[:3000])  # cut off
    assert main(["show", "a"]) == 0
    assert main(["show", "a", "--figure", "f.png"]) == 2
    for number in range(45):
        Path("empty", f"{number}.png").touch()
    capsys.readouterr()
    assert main(["show", "empty"]) == 0
    assert shown(capsys)["and"] == "5 more"


def test_sizes():
    assert [bytes_told(n) for n in (999, 70800, 1.5e9, 2e15)] == [
        "999 B",
        "70.8 kB",
        "1.5 GB",
        "2e+03 TB",
    ]


def test_export(tmp_path, capsys):
    random_run("t.h5")
    assert main(["export", "t.h5"]) == 0
    captured = capsys.readouterr()
    assert "5 of 5" in captured.out and "t.vtkhdf" in captured.out and "5/5" in captured.err
    arguments = ["--fields", "pressure", "velocity", "--every", "2", "--out", "new/x.vtkhdf"]
    assert main(["export", "t.h5", *arguments]) == 0
    rows = shown(capsys)
    assert rows["snapshots"] == "3 of 5" and rows["fields"] == "position, pressure, velocity"
    assert sorted(p.name for p in tmp_path.rglob("*.*")) == ["t.h5", "t.vtkhdf", "x.vtkhdf"]


def test_animate(tmp_path, capsys, monkeypatch):
    random_run("t.h5")
    assert tuple(DRAWN) == FIELDS
    assert main(["animate", "t.h5", "--field", "density", "--every", "3", "--fps", "5"]) == 0
    captured = capsys.readouterr()
    assert "2 of 5 snapshots, 5 per second" in captured.out and "2/2" in captured.err
    with Image.open("t.gif") as picture:
        assert (picture.n_frames, picture.info["duration"]) == (2, 200)
    monkeypatch.setattr("jaxsph.cli.animate.FRAMES", 2)  # every third of five then
    assert main(["animate", "t.h5", "--out", "new/x.gif"]) == 0
    assert shown(capsys)["frames"] == "2 of 5 snapshots, 15 per second"


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["show", "missing.h5"], "no such file"),
        (["show", "text"], "not an HDF5 file"),
        (["show", "t.h5", "--figure", "text/f.png"], "Not a directory"),
        (["export", "t.h5", "--out", "t.h5"], "is the trajectory itself"),
        (["export", "t.h5", "--fields", "speed"], "--fields: invalid choice: 'speed'"),
        (["export", "t.h5", "--every", "0"], "--every: must be at least 1"),
        (["export", "t.h5", "--out", "text/t.vtkhdf"], "Not a directory"),
        (["animate", "t.h5", "--out", "t.avi"], "end with .gif or .mp4"),
        (["animate", "t.h5", "--fps", "0"], "--fps: must be at least 1"),
        (["animate", "t.h5", "--field", "colour"], "--field: invalid choice: 'colour'"),
        (["animate", "missing.h5"], "no such file"),
    ],
)
def test_bad_input_is_one_line(tmp_path, capsys, arguments, message):
    random_run("t.h5", count=2)
    (tmp_path / "text").write_text("text")
    assert main(arguments) == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert error.startswith("jaxsph: error: ") and message in error
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["t.h5", "text"]
