"""Work and precision: the front, the cheapest setting, and a tiny run that is taken up again."""

import dataclasses
import json

import jax
import numpy as np
import pytest

from benchmarks.work_precision import __main__ as work_precision
from benchmarks.work_precision.report import cheapest, figure, pareto_front, tables
from benchmarks.work_precision.scenes import command, errors, make_scene
from benchmarks.work_precision.settings import (
    FULL,
    GRIDS,
    MOVING,
    QUICK,
    SAMPLED,
    TENSOR,
    Case,
    FullSetting,
    Grid,
    ReducedSetting,
    crossed,
    named,
    varied,
)
from jaxsph import Trajectory, run_scene
from jaxsph_command.commands import parser as parser_of
from jaxsph_rom import advice

CASE = Case(100.0, (100.0,), 0.05, 0.0, "the exact solution")
PACKED = FullSetting(12, start="packed")
LATTICE = FullSetting(12, start="rest")  # quickly made


def row(family, label, velocity, pressure, seconds, fault=None):
    return {
        "family": family, "label": label, "fault": fault, "settings": {"resolution": 8},
        "velocity_peak_percent": velocity, "velocity_median_percent": velocity,
        "pressure_peak_percent": pressure, "pressure_median_percent": pressure,
        "run_seconds": {"median": seconds, "min": seconds, "spread": 0.0, "repeats": 1},
        "compile_seconds": 1.0, "offline_seconds": None if family == FULL else 20.0,
        "command": f"run {label}",
    }  # fmt: skip


ROWS = [
    row(FULL, "coarse", 8.0, 40.0, 1.0),
    row(FULL, "fine", 1.0, 5.0, 20.0),
    row(FULL, "wasteful", 8.5, 6.0, 10.0),
    row(TENSOR, "M = 5", 2.0, 4.0, 0.01),
    {"family": MOVING, "label": "lost", "settings": {}, "fault": "step 3: not finite."},
]


def test_the_front_holds_what_no_other_is_better_than():
    assert pareto_front([(1, 8), (2, 3), (3, 3), (2.5, 5), (4, 1)]) == [0, 1, 4]
    assert pareto_front([(2, 1), (1, 1), (1, 2)]) == [1]
    assert pareto_front([]) == []
    points = np.random.default_rng(0).uniform(size=(200, 2))
    front = points[pareto_front(points)]
    assert (np.diff(front[:, 0]) > 0).all() and (np.diff(front[:, 1]) < 0).all()
    for cost, error in points:
        assert ((front[:, 0] <= cost) & (front[:, 1] <= error)).any()


def test_the_cheapest_within_an_error():
    full = [r for r in ROWS if r["family"] == FULL]
    assert cheapest(full, "velocity_peak_percent", 9.0)["label"] == "coarse"
    assert cheapest(full, "pressure_median_percent", 7.0)["label"] == "wasteful"
    assert cheapest(ROWS, "velocity_peak_percent", 2.0)["label"] == "M = 5"
    assert cheapest(ROWS, "velocity_peak_percent", 0.5) is None
    text = tables("taylor-green", ROWS)
    assert "failed: on moving particles, lost: step 3" in text and "tensor: M = 5 (0.01 s)" in text


def test_the_figure(tmp_path):
    case = {"reynolds": 100.0, "steady": False}
    assert figure("taylor-green", ROWS, case, tmp_path / "f.png").stat().st_size > 10_000


@pytest.mark.parametrize("grids", [GRIDS, QUICK])
def test_grids_vary_one_thing_at_a_time_and_name_each_setting(grids):
    for grid in grids.values():
        names = [(s.family, named(s)) for s in grid.settings]
        assert len(set(names)) == len(names)
        wanted = {FULL, MOVING, TENSOR} if grid.case.trained_on else {FULL}
        assert {s.family for s in grid.settings} >= wanted
    assert SAMPLED in {s.family for s in GRIDS["taylor-green"].settings}
    assert varied(PACKED, mach=(0.2,)) == [PACKED, dataclasses.replace(PACKED, mach=0.2)]
    assert len(crossed(PACKED, resolution=(8, 12), step=(0.5, 0.9))) == 4


def test_errors_vanish_for_the_reference_itself():
    scene = make_scene("taylor-green", CASE, dataclasses.replace(LATTICE, resolution=16), 100.0)
    state = scene.state
    still = Trajectory(
        np.array([0.0, 1e-9]),
        *(np.stack([np.asarray(a)] * 2) for a in (state.position, state.velocity, state.density)),
        np.stack([np.asarray(scene.fluid.pressure(state.density))] * 2),
    )
    found = errors(CASE, scene, still)
    # round-off of a pressure of 250 Pa in c0^2 rho0 = 1e5 Pa, and 1e-9 s of decay
    assert 0.0 <= found["velocity_peak_percent"] < 1e-5
    assert 0.0 <= found["pressure_median_percent"] < 1e-5
    twice = dataclasses.replace(still, velocity=2.0 * still.velocity)
    assert errors(CASE, scene, twice)["velocity_peak_percent"] == pytest.approx(100.0)


def test_a_step_is_within_its_share_of_the_limit():
    for setting in (LATTICE, dataclasses.replace(LATTICE, step=0.3, mach=0.2)):
        scene = make_scene("taylor-green", CASE, setting, 100.0)
        assert scene.time_step <= setting.step * scene.stable_time_step * (1.0 + 1e-12)
    bare = make_scene(
        "taylor-green", CASE, dataclasses.replace(LATTICE, delta=0.0, shifting=False), 100.0
    )
    assert [e.name for e in bare.effects] == ["Continuity", "PressureForce", "LaminarViscosity"]


@pytest.mark.parametrize(
    "changed",
    [
        pytest.param({"start": "quiet"}, marks=pytest.mark.slow),  # stirs and balances
        {"delta": 0.0, "shifting": False},
        {"delta": 0.2},
        {"kernel": "WendlandC4"},
    ],
)
def test_a_python_call_makes_the_very_scene(changed):
    setting = dataclasses.replace(LATTICE, resolution=16, **changed)
    scene = make_scene("taylor-green", CASE, setting, 100.0)
    call = command("taylor-green", CASE, setting, scene.time_step)
    assert call.splitlines()[-1] == "run = jaxsph.run_scene(scene)"
    names: dict = {}
    exec("\n".join(call.splitlines()[:-1]), names)
    made = names["scene"]
    assert [e.name for e in made.effects] == [e.name for e in scene.effects]
    assert (made.time_step, made.steps, made.space) == (scene.time_step, scene.steps, scene.space)
    np.testing.assert_array_equal(made.state.density, scene.state.density)
    for ours, theirs in zip(made.effects, scene.effects, strict=True):
        assert jax.tree.leaves(ours) == jax.tree.leaves(theirs)


def test_commands_of_reduced_models_are_understood():
    for name, grid in GRIDS.items():
        for setting in grid.settings:
            if setting.family not in (MOVING, TENSOR):
                continue
            words = command(name, grid.case, setting, 1e-3).split()
            assert words[0] == "jaxsph-rom"
            options = parser_of("jaxsph-rom", words[1:]).parse_args(words[1:])
            assert options.modes == [setting.modes] and options.resolution == setting.resolution
            assert options.inner_product == setting.product


def test_a_tiny_run_is_taken_up_again(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    lost = dataclasses.replace(PACKED, resolution=2)  # the box is too small for the kernel
    grid = Grid(CASE, (PACKED, lost))
    monkeypatch.setattr(work_precision, "QUICK", {"taylor-green": grid})
    path, table = tmp_path / "r.json", tmp_path / "t.json"
    arguments = ["taylor-green", "--quick", "--json", str(path), "--out", str(tmp_path / "o"),
                 "--figure", str(tmp_path / "f.png"), "--advice", str(table)]  # fmt: skip
    assert work_precision.main(arguments) == 0
    good, failed = json.loads(path.read_text())["scenes"]["taylor-green"]["rows"]
    assert good["fault"] is None and good["run_seconds"]["repeats"] == 3
    assert 0 < good["velocity_peak_percent"] < 10 and good["compile_seconds"] > 0
    assert failed["fault"] and "velocity_peak_percent" not in failed
    assert (tmp_path / "f_taylor_green.png").exists()
    shipped = advice.read_table(table)["scenes"]["taylor-green"]
    assert [r.label for r in shipped["rows"]] == [good["label"]] and shipped["reynolds"] == 100.0
    assert good["command"].startswith("jaxsph run taylor-green")

    written = path.read_text()
    more = Grid(CASE, (*grid.settings, dataclasses.replace(PACKED, step=0.5)))
    monkeypatch.setattr(work_precision, "QUICK", {"taylor-green": more})
    assert work_precision.main(arguments) == 0
    rows = json.loads(path.read_text())["scenes"]["taylor-green"]["rows"]
    assert rows[:2] == json.loads(written)["scenes"]["taylor-green"]["rows"] and len(rows) == 3
    capsys.readouterr()

    other = Grid(dataclasses.replace(CASE, end_time=0.1), grid.settings)
    monkeypatch.setattr(work_precision, "QUICK", {"taylor-green": other})
    assert work_precision.main(arguments) == 2
    assert "holds another case of taylor-green" in capsys.readouterr().err


@pytest.mark.slow
def test_every_family(tmp_path):
    case = Case(125.0, (100.0, 150.0), 0.06, 0.0, "the exact solution")
    settings = (
        ReducedSetting(2, resolution=16),
        ReducedSetting(2, "tensor", resolution=16),
        ReducedSetting(2, "q-deim", samples=6, resolution=16),
    )
    for setting in settings:
        made = work_precision.measured("taylor-green", case, setting, tmp_path)
        assert made["fault"] is None
        assert 0 < made["velocity_peak_percent"] < 30  # 16 x 16 particles
        assert made["offline_seconds"] > made["training_run_seconds"] > 0
        assert made["run_seconds"]["median"] > 0


def test_a_packed_command_line_is_the_scene_itself():
    scene = make_scene("taylor-green", CASE, PACKED, 100.0)
    line = command("taylor-green", CASE, PACKED, scene.time_step)
    assert f"--time-step {scene.time_step!r}" in line and "--h-over-dx 2 " in line
    assert run_scene(scene).time[-1] == pytest.approx(CASE.end_time)
