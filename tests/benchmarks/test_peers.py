"""The comparison runs with whichever codes are there, and refuses paths where there is none."""

import json
import math
import sys

import jax
import numpy as np
import pytest

from benchmarks.peers import __main__ as peers
from benchmarks.peers import setup
from benchmarks.peers.accuracy import at_equal_time
from benchmarks.peers.ours import Ours
from benchmarks.peers.protocol import PLAIN, RICHEST
from benchmarks.peers.speed import make_scene, write_case
from benchmarks.peers.workers import JAX_SPH, OURS, PYSPH, Code, WorkerError, workers
from jaxsph.arrangements import JitteredLattice


@pytest.fixture(autouse=True)
def in_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.slow
def test_runs_without_peers(tmp_path, capsys):
    path = tmp_path / "peers.json"
    sizes = ["--resolution", "12", "--h-over-dx", "2", "--repeats", "2", "--end-time", "0.05"]
    runs = ["--run-resolution", "12", "--finer", "--scheme", PLAIN]
    assert peers.main([*sizes, *runs, "--json", str(path)]) == 0
    read = json.loads(path.read_text())
    assert jax.config.jax_enable_x64  # a benchmark's precision stays its own
    assert read["missing"].keys() == {PYSPH, JAX_SPH}
    (row,) = read["right_hand_sides"]
    found = row["codes"][OURS]
    assert row["particles"] == 144 and row["failed"] == {}
    assert found["ratio"] == 1.0 and found["right_hand_side"]["repeats"] == 2
    assert math.isclose(
        found["ns_per_pair"], 1e9 * found["right_hand_side"]["median"] / row["pairs"]
    )
    assert [term.split(":")[0] for term in found["terms"]] == [
        "Continuity", "PressureForce", "IsotropicViscosity",
    ]  # fmt: skip
    (run,) = read["runs"]
    assert run["fault"] is None and run["right_hand_sides"] == 4 * run["steps"]
    # 2 percent at t = 0.05 s as in the convergence benchmark, and 5 for want of shifting
    assert 0.0 < run["velocity_error_percent"] < 5.0
    assert read["equal_time"] == [] and "missing: PySPH" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--jax-sph", "nowhere"], "--jax-sph: nowhere holds no jax_sph/solver.py"),
        (["--pysph-python", "nowhere"], "--pysph-python: nowhere is no program"),
        (["--pysph-python", sys.executable], "cannot import pysph.solver.solver (ModuleNotFound"),
        (["--scheme", "best"], "invalid choice: 'best'"),
    ],
)
def test_wrong_input_is_one_line(arguments, told, capsys):
    assert peers.main(arguments) == 2
    error = capsys.readouterr().err
    assert told in error and len(error.splitlines()) == 1


def test_environments_stay_out_of_the_repository(capsys):
    assert setup.main([str(setup.Path(setup.__file__).parent / "environments")]) == 2
    assert "is in this repository" in capsys.readouterr().err


def test_our_side_gives_the_functional_of_the_scene(tmp_path):
    scene = make_scene(12, 2.0, 100.0, JitteredLattice())
    side = Ours()
    found = side.load(**write_case(tmp_path, scene, RICHEST, 0.05, slices=2))
    assert len(found["terms"]) == len(scene.effects) == 6
    neighbors = scene.search().build(scene.state.position)
    rates = scene.functional()(np.zeros(()), scene.state, neighbors)
    acceleration, density_rate = side.derivative()
    # the same sums, fused otherwise
    np.testing.assert_allclose(acceleration, rates.velocity, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(density_rate, rates.density, rtol=1e-9, atol=1e-7)
    plan = side.prepare()
    assert plan["time_step"] * plan["steps"] * 2 == pytest.approx(0.05)
    assert side.advance()["fault"] is None


@pytest.mark.slow
def test_a_failing_code_says_why(tmp_path):
    with workers([Code(OURS, sys.executable, "ours")]) as (started, _):
        with pytest.raises(WorkerError, match="one of load, .* got 'sing'"):
            started[OURS].ask("sing")
        with pytest.raises(WorkerError, match="no_such_file"):
            started[OURS].ask("load", **dict(CASE, particles="no_such_file"))
    with (
        workers([Code("nothing", sys.executable, "nothing")]) as (started, _),
        pytest.raises(WorkerError, match="No module named benchmarks.peers.nothing"),
    ):
        started["nothing"].ask("load")


CASE = {
    "scheme": PLAIN, "resolution": 12, "h_over_dx": 2.0, "reynolds": 100.0, "mach": 0.1,
    "reference_density": 1000.0, "end_time": 1.0, "slices": 1,
}  # fmt: skip


def test_equal_time_is_read_off_our_own_runs():
    def run(code, seconds, error):
        return {"code": code, "scheme": PLAIN, "resolution": 1, "seconds": seconds,
                "velocity_error_percent": error, "fault": None}  # fmt: skip

    ours = [run(OURS, 1.0, 4.0), run(OURS, 4.0, 1.0), run(OURS, 2.0, 8.0)]  # the last is no gain
    inside, beyond = at_equal_time([*ours, run(PYSPH, 2.0, 2.0), run(JAX_SPH, 16.0, 0.5)])
    assert inside["our_error_percent_in_that_time"] == pytest.approx(2.0)
    assert inside["our_seconds_for_that_error"] == pytest.approx(2.0)
    assert not inside["error_bound"] and not inside["seconds_bound"]
    assert beyond["error_bound"] and beyond["our_error_percent_in_that_time"] == pytest.approx(1.0)
    assert beyond["time_ratio"] == pytest.approx(4.0) and beyond["seconds_bound"]
