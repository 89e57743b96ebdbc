"""Error against time: which full model a reduced one is compared with, and the figure."""

import json

import pytest

from benchmarks import error_against_time
from benchmarks.error_against_time import CLOSED, FULL, equal_error


def row(family, resolution, velocity, pressure, seconds):
    return {
        "family": family,
        "resolution": resolution,
        "setting": f"{resolution} x {resolution}",
        "modes": 5,
        "exact_velocity_peak_percent": velocity,
        "exact_pressure_median_percent": pressure,
        "seconds": seconds,
    }


ROWS = [row(FULL, 16, 8.0, 4.0, 1.0), row(FULL, 32, 2.0, 5.0, 8.0), row(FULL, 64, 0.5, 1.0, 64.0)]


def test_a_reduced_model_is_compared_with_the_cheapest_full_one_as_good():
    found = equal_error(row(CLOSED, 64, 2.5, 5.5, 0.01), ROWS)
    assert found["as_good_full"] == "32 x 32" and found["faster_than_as_good_full"] == 800.0
    assert found["faster_than_full"] == pytest.approx(6400.0)
    both = equal_error(row(CLOSED, 64, 2.5, 4.5, 0.01), ROWS)  # 32 has too large a pressure error
    assert both["as_good_full"] == "64 x 64"
    better = equal_error(row(CLOSED, 64, 0.4, 0.9, 0.01), ROWS)
    assert better["as_good_full"] == "beyond 64 x 64"
    assert equal_error(ROWS[0], ROWS) == {}


def test_the_figure(tmp_path):
    path = error_against_time.figure([*ROWS, row(CLOSED, 64, 0.6, 1.1, 0.01)], tmp_path / "f.png")
    assert path.stat().st_size > 10_000


@pytest.mark.slow
def test_all_families(tmp_path, capsys):
    path, image = tmp_path / "r.json", tmp_path / "f.png"
    arguments = ["--resolution", "48", "--end-time", "0.05", "--modes", "2", "--iterations", "10",
                 "--out", str(tmp_path), "--json", str(path), "--figure", str(image)]  # fmt: skip
    assert error_against_time.main(arguments) == 0
    read = json.loads(path.read_text())
    assert {r["family"] for r in read["rows"]} == set(error_against_time.MARKS)
    finest = [r for r in read["rows"] if r["family"] == FULL][-1]
    assert finest["full_velocity_peak_percent"] == 0.0 and image.exists()
    assert "paid back after" in capsys.readouterr().out
