"""A pressure that is uniform has no percentage, whoever judges it: pascal instead."""

from types import SimpleNamespace

import numpy as np
import pytest

from jaxsph import Fluid
from jaxsph.arrangements import Lattice
from jaxsph.scenes import taylor_green
from jaxsph_rom import Study
from jaxsph_rom.cli.train import error_lines
from jaxsph_rom.points.training.training_errors import discrepancies
from jaxsph_rom.pressure_noise import is_noise
from jaxsph_rom.report import discrepancy_history, format_table, verdict
from jaxsph_rom.study.method import ReducedRun

FLUID = Fluid(1000.0, 5.0, 0.5)  # 0.01 rho0 U^2 = 2.5 Pa
PROBES = np.array([0.0, 1.0, 2.0, 3.0])
TIMES = np.array([0.0, 0.1, 0.2])
OFF = np.array([1.0, 4.0, 2.0])  # Pa


def test_a_range_below_a_hundredth_of_rho_u_squared_is_noise():
    assert is_noise(0.8 * PROBES[None], FLUID) and not is_noise(0.9 * PROBES[None], FLUID)
    assert is_noise(np.full((3, 4), 1e5), FLUID)  # whatever its level
    resting = np.stack([0.0 * PROBES, PROBES])
    assert not is_noise(resting, FLUID)  # as of a start from rest: it has a range later


@pytest.mark.parametrize("size, uniform", [(0.5, True), (5.0, False)])
def test_a_model_on_its_training_runs(size, uniform):
    speed = np.stack([PROBES + 1.0] * 3)
    truth = speed, np.outer(np.ones(3), size * PROBES)
    fields = SimpleNamespace(
        velocity=1.02 * speed[..., None], pressure=truth[1] + OFF[:, None]
    )
    flow = SimpleNamespace(fields=lambda *_, **__: fields)
    found = discrepancies(flow, FLUID, np.zeros((3, 1)), truth)
    assert (found["pressure_peak_pascal"], found["pressure_median_pascal"]) == (4.0, 2.0)
    percent = (None, None) if uniform else pytest.approx((400.0 / 15.0, 200.0 / 15.0))
    assert (found["pressure_peak_percent"], found["pressure_median_percent"]) == percent
    row = {"parameters": {"force": 2.0}, "errors": found, "floor": found}
    (line,) = error_lines({"runs": [row]})
    assert ("pressure 4 (4), 2 (2) Pa, which is uniform" in line) == uniform
    assert line.startswith("force 2: velocity 1.67 (1.67), 1.67 (1.67); pressure ")


@pytest.mark.parametrize("size, uniform", [(1.0, True), (100.0, False)])
def test_a_study_and_what_it_writes(tmp_path, size, uniform):
    scene = taylor_green(12, 100.0, arrangement=Lattice(), end_time=0.05)  # rho0 U^2 = 1000 Pa
    speed, pressure = np.stack([PROBES + 1.0] * 3), np.outer(np.ones(3), size * PROBES)
    trajectory = SimpleNamespace(time=TIMES, timing=SimpleNamespace(compile_seconds=0.0),
                                 particles=144)  # fmt: skip
    study = Study(lambda reynolds: scene, tmp_path)
    study.runs = SimpleNamespace(
        scene=lambda reynolds: scene, full=lambda reynolds: trajectory,
        profile=lambda reynolds: (speed, pressure), seconds=lambda reynolds: 8.0,
    )  # fmt: skip
    told = {"modes": 2, "projection": "galerkin", "tau": None, "hyper": "tensor",
            "trained_on": (50.0,), "rom_seconds": 0.004, "rom_compile_seconds": 1.0}  # fmt: skip
    run = ReducedRun(100.0, trajectory, (speed, pressure + OFF[:, None]), None, told, None)
    outcome = study._judged(run, SimpleNamespace(product_name="energy"))
    case = outcome.case
    assert case.sound and case.uniform_pressure == uniform
    assert (case.pressure_peak_pascal, case.pressure_median_pascal) == (4.0, 2.0)
    assert case.pressure_peak_percent == (None if uniform else pytest.approx(4.0 / 3.0))
    assert np.isnan(outcome.pressure_percent).all() == uniform
    remark = "no pressure to compare with (uniform), off by 4 Pa at most, 2 Pa in the median"
    assert (remark in " ".join(format_table([case]).split())) == uniform
    (text,) = verdict([case])
    assert ("no pressure to compare with (off by 4 Pa)" in text) == uniform
    assert ("pressure within 1.3 %" in text) != uniform
    history = ("run", TIMES, outcome.velocity_percent, outcome.pressure_percent)
    assert discrepancy_history([history], tmp_path / "d.png").stat().st_size > 5000
