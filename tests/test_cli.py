"""The command line: what it writes and prints, and how it says no."""

import dataclasses
import inspect
import json
import os
import platform
import re
import subprocess
import sys
import warnings
from pathlib import Path

import jax
import numpy as np
import pytest

import jaxsph
from jaxsph.arrangements import Lattice
from jaxsph.cli import SCALES, main
from jaxsph.environment import environment
from jaxsph.integrate import FaultCode, SimulationError
from jaxsph.io import TrajectoryWriter, read_checkpoint, read_trajectory
from jaxsph.metrics import kinetic_energy
from jaxsph.report.settings import CITATION
from jaxsph.scenes import SCENES, taylor_green
from jaxsph_command.scenes import scenes
from tests.pages import checked_page

TINY = ["run", "taylor-green", "--resolution", "16", "--t-end", "0.1", "--arrangement", "lattice"]


@pytest.fixture(autouse=True)
def in_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def last_line(capsys):
    return capsys.readouterr().err.strip().splitlines()[-1]


def test_lists_scenes(capsys):
    assert main(["scenes"]) == 0
    printed = capsys.readouterr().out
    for word in SCENES:
        assert f"\n{word}: " in f"\n{printed}"
    # the sizes that are read from the sources are those of the scenes
    for name, make in SCENES.items():
        sizes = {found: scales for found, _, scales in scenes()}[name]
        assert tuple(sizes) == SCALES
        module = inspect.getmodule(make)
        for kept in sizes["small"].items():
            assert kept[0] in ("resolution", "h_over_dx", "time_step", "steps_per_snapshot")
        for table in (vars(module).get(n) for n in ("SCALES", "SCALES_3D") if n in vars(module)):
            if table["small"].resolution == sizes["small"]["resolution"]:
                assert {k: dataclasses.asdict(v) for k, v in table.items()} == sizes
    assert main(["scenes", "--json", "new/all.json"]) == 0
    told = json.loads(Path("new/all.json").read_text())
    assert tuple(told) == tuple(SCENES) and told["dam-break"]["sizes"]["small"]["resolution"] > 0
    assert main(["scenes", "dam-break", "--scale", "small", "--json", "one.json"]) == 0
    printed = capsys.readouterr().out
    told = json.loads(Path("one.json").read_text())["dam-break"]
    assert told["built"]["small"]["particles"] == 1800
    assert "FreeSurface" in told["built"]["small"]["effects"]
    assert "[m]" in told["settings"]["tank"]
    for word in ("PressureForce", "FreeSurface", "1800 particles", "column"):
        assert word in printed


@pytest.mark.slow
def test_lists_scenes_at_all_scales(capsys):
    assert main(["scenes", *(word for scale in SCALES for word in ("--scale", scale))]) == 0
    printed = capsys.readouterr().out
    assert all(printed.count(f"  {scale} ") == len(SCENES) for scale in SCALES)


def test_run(tmp_path, capsys):
    assert main([*TINY, "--reynolds", "50", "--json", "results/run.json"]) == 0
    captured = capsys.readouterr()
    trajectory = read_trajectory(tmp_path / "out" / "taylor-green" / "trajectory.h5")
    assert trajectory.particles == 256
    assert trajectory.time[-1] == pytest.approx(0.1)
    assert trajectory.metadata["parameters"]["reynolds"] == 50.0
    assert jax.config.jax_enable_x64 and trajectory.position.dtype == np.float64
    results = json.loads((tmp_path / "results" / "run.json").read_text())
    assert results["steps"] == trajectory.metadata["steps"] == 10
    assert results["run_seconds"] == trajectory.metadata["run_seconds"] > 0
    # at h = 2 dx and 16 particles a side; it is 3 and 1 percent, falling with resolution
    assert 0 < results["errors"]["velocity_relative_l2"] < 0.1
    assert results["errors"]["kinetic_energy_relative"] < 0.1
    assert results["versions"]["jaxsph"] == jaxsph.__version__
    assert results["dtype"] == "float64"
    for word in ("particles", "steps", "compile", "per particle and step", "velocity error"):
        assert word in captured.out
    bar = captured.err.splitlines()[-1].rpartition("\r")[2]
    assert re.search(r"10/10 \[\d\d:\d\d<\d\d:\d\d", bar)  # time taken and time left
    energy = kinetic_energy(trajectory.velocity[-1], 1000.0 / 256)
    assert f"kinetic energy {energy:.4g} J/m]" in bar


def test_every_run_leaves_a_page(tmp_path, capsys):
    assert main([*TINY, "--reynolds", "50", "--out", str(tmp_path / "out/taylor-green")]) == 0
    printed = capsys.readouterr().out
    assert "out/taylor-green/report.html" in printed
    page = checked_page(tmp_path / "out" / "taylor-green" / "report.html")
    assert len(page.figures) == 2
    words = ("taylor-green", "reynolds", "AdjointPressure", "jaxlib", "cores", "Kinetic energy")
    for word in words:
        assert word in page.text
    for name in ("run", "compile", "velocity error", "kinetic energy error"):
        value = page.cells[page.cells.index(name) + 1]
        assert f"{name:22} {value}" in printed
    assert page.cells[page.cells.index("command") + 1] == f"jaxsph {' '.join(TINY)} --reynolds 50"
    assert re.match(r"20\d\d-\d\d-\d\d \d\d:\d\d", page.cells[page.cells.index("made") + 1])
    assert page.cells[page.cells.index("cite") + 1] == CITATION
    assert len(page.scripts) == 1  # the run with a slider
    assert str(tmp_path) not in page.source and platform.node() not in page.text


def test_single_precision_stays_inside(capsys):
    jittered = [*TINY[:-1], "jittered", "--seed", "3"]
    assert main([*jittered, "--precision", "float32", "--out", "single"]) == 0
    read = read_trajectory("single/trajectory.h5")
    assert read.velocity.dtype == np.float32
    assert read.metadata["parameters"]["arrangement"]["seed"] == 3
    assert jax.config.jax_enable_x64


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "COMMAND"),
        (["run"], "SCENE"),
        (["run", "no-such-scene"], "choose one of taylor-green, taylor-green-3d"),
        ([*TINY, "--reynolds", "0"], "--reynolds: must be positive and finite, got 0"),
        ([*TINY, "--reynolds", "-5"], "--reynolds: must be positive and finite, got -5"),
        ([*TINY, "--reynolds", "nan"], "--reynolds: must be positive and finite, got nan"),
        ([*TINY, "--reynolds", "many"], "--reynolds"),
        ([*TINY, "--resolution", "0"], "--resolution: must be at least 1"),
        ([*TINY, "--resolution", "5"], "too small for a kernel support"),
        ([*TINY, "--resolution", "9"], "too small for a kernel support"),  # with the list's skin
        ([*TINY, "--h-over-dx", "0.5"], "h_over_dx: at least 1"),
        ([*TINY, "--time-step", "0.5"], "beyond the stability limit"),
        ([*TINY, "--t-end", "-1"], "--t-end: must be positive"),
        ([*TINY, "--scale", "huge"], "--scale"),
        ([*TINY, "--seed", "-1"], "--seed"),
        ([*TINY, "--capacity-margin", "0.5"], "--capacity-margin: must be at least 1"),
        ([*TINY, "--out", "file"], "Not a directory"),
        ([*TINY, "--json", "file/run.json"], "Not a directory"),
        ([*TINY, "--json", "folder"], "is a folder"),
        (["run", "taylor-green", "--resume", "missing.h5"], "no such file"),
        (["run", "taylor-green", "--resume", "file"], "not an HDF5 file"),
        (["run", "taylor-green", "--resume", "file", "--seed", "0"], "--seed: a resumed run"),
        ([*TINY, "--unknown"], "--unknown"),
    ],
)
def test_bad_input_is_one_line(tmp_path, capsys, arguments, message):
    (tmp_path / "file").write_text("text")
    (tmp_path / "folder").mkdir()
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert error.startswith("jaxsph: error: ") and error.count("\n") == 1
    assert message in error
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["file", "folder"]


def test_existing_trajectory_is_kept(capsys):
    Path("out/taylor-green").mkdir(parents=True)
    Path("out/taylor-green/trajectory.h5").write_text("precious")
    assert main(TINY) == 2
    assert "exists already" in last_line(capsys)
    assert Path("out/taylor-green/trajectory.h5").read_text() == "precious"
    assert main([*TINY, "--overwrite"]) == 0
    assert read_checkpoint("out/taylor-green/trajectory.h5").complete


def test_fault_in_mid_run_then_resumed(capsys, monkeypatch):
    monkeypatch.setattr(jaxsph.FullModel, "enlarged", lambda self: None)
    # a list without spare room: the lattice fits, what it turns into does not
    assert main([*TINY, "--capacity-margin", "1", "--out", "run"]) == 1
    error = last_line(capsys)
    read = read_trajectory("run/trajectory.h5")
    assert 0.0 < read.time[-1] < 0.1
    assert error.startswith("jaxsph: error: step ")
    assert f"run/trajectory.h5 holds the snapshots up to t = {read.time[-1]:.6g} s." in error
    page = checked_page(Path("run/report.html"))
    assert page.cells[page.cells.index("fault") + 1].startswith("step ") and len(page.figures) == 2
    resume = ["run", "taylor-green", "--resume", "run/trajectory.h5", "--capacity-margin", "1.3"]
    assert main(resume) == 0
    resumed = read_trajectory("run/trajectory.h5")
    np.testing.assert_array_equal(resumed.position[: len(read.time)], read.position)
    assert resumed.time[-1] == pytest.approx(0.1)
    assert resumed.metadata["resumed_from_step"] == round(read.time[-1] / 0.01)


def test_a_full_neighbor_list_is_enlarged_and_the_run_goes_on():
    """The same flow with a list that fits from the start: enlarging changes nothing else."""
    scene = taylor_green(16, arrangement=Lattice(), end_time=0.1)
    runs = []
    for margin in (1.0, 2.0):
        model = scene.model(margin=margin)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            runs.append(jaxsph.simulate(model, scene.state, scene.schedule))
        told = [w for w in caught if "allocated it anew" in str(w.message)]
        assert len(told) == len(runs[-1].metadata["enlarged_at"])
    assert runs[0].metadata["enlarged_at"] and not runs[1].metadata["enlarged_at"]
    # the same neighbours in the same order: sums differ by round-off at most
    np.testing.assert_allclose(runs[0].position, runs[1].position, atol=1e-12)


def test_fault_keeps_all_snapshots_before_it(tmp_path):
    # Particles rush towards the middle at 16/s a direction: their density is beyond its bounds,
    # 1.2 times as high, after about ln(1.2) / 32 s, which is 6 ms.
    scene = taylor_green(16, arrangement=Lattice(), time_step=0.001)
    converging = 16.0 / (2.0 * np.pi) * np.sin(2.0 * np.pi * scene.state.position)
    state = jaxsph.ParticleState(scene.state.position, converging, scene.state.density)
    with TrajectoryWriter.create(tmp_path / "t.h5", scene) as writer:
        with pytest.raises(SimulationError) as caught:
            jaxsph.simulate(
                scene.model(state, margin=3.0),
                state,
                scene.schedule,
                recorder=writer,
            )
        assert caught.value.code == FaultCode.DENSITY_OUT_OF_BOUNDS
        assert caught.value.particle >= 0
    read = read_trajectory(tmp_path / "t.h5")
    failed = caught.value.step
    whole = (failed - 1) // scene.steps_per_snapshot
    assert len(read.time) == whole + 1 > 1
    assert np.max(read.density) < 1200.0
    assert 4 <= failed <= 10
    assert f"step {failed} " in str(caught.value)


def test_as_a_module():
    root = Path(jaxsph.__file__).parents[1]
    done = subprocess.run(
        [sys.executable, "-m", "jaxsph", "--version"],
        env={**os.environ, "PYTHONPATH": str(root)},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (done.returncode, done.stdout.strip()) == (0, f"jaxsph {jaxsph.__version__}")


def test_environment_tells_no_names_or_folders():
    text = json.dumps(environment())
    assert str(Path.home()) not in text and platform.node() not in text
