"""The verdict in words of cases whose numbers are known."""

import math

from jaxsph_rom.report import best, verdict
from tests.rom.report.test_report import case


def on_points(reynolds, **changes):
    """8 s full, 4 ms reduced, 20 s of training runs and 11.9 s to make the model of them."""
    values = {"hyper": "tensor", "projection": "galerkin", "tau": None, "fom_seconds": 8.0,
              "rom_seconds": 0.004, "training_seconds": 20.0, "offline_seconds": 11.9}  # fmt: skip
    return case(reynolds=reynolds, **(values | changes))


def test_times_errors_and_when_it_has_paid():
    cases = [
        on_points(125.0, velocity_peak_percent=0.5, pressure_peak_percent=2.0),
        on_points(175.0, velocity_peak_percent=0.25, velocity_median_percent=0.125,
                  pressure_peak_percent=4.0, pressure_median_percent=1.0),  # fmt: skip
        on_points(150.0, velocity_peak_percent=99.0),  # of its own training: not judged by it
    ]
    (text,) = verdict(cases)
    assert text == (
        "On points, tensor, M = 5, at Re 125, 175: 2,000 times faster than the full model, "
        "velocity within 0.5 % (1.2 % in the median over time), "
        "pressure within 4 % (2 % in the median over time). "
        "Making it took 31.9 s, 20 s of them full runs: paid back after 4 runs."
    )


def test_a_field_that_is_wrong_by_all_of_itself_is_said_to_be_no_use():
    (text,) = verdict(
        [on_points(125.0, pressure_peak_percent=1964.0, pressure_median_percent=190.0)]
    )
    assert "pressure within 2,000 % (190 % in the median over time), no better than none." in text
    (text,) = verdict([on_points(125.0, pressure_median_percent=99.0)])
    assert "no better" not in text


def test_the_number_of_modes_that_errs_least_speaks_for_its_kind():
    few = [on_points(125.0, modes=3, velocity_peak_percent=0.1)]
    many = [on_points(125.0, modes=10, velocity_peak_percent=0.01, stable=False)]
    moving = [case(hyper="none", modes=4, fom_seconds=8.0, rom_seconds=16.0)]
    assert best(few + many) == few
    points, particles = verdict(few + many + moving)
    assert "M = 3" in points and "M = 4" in particles
    assert "2 times slower than the full model" in particles
    assert "it never pays back its training" in particles


def test_a_failed_run_is_named_and_nothing_is_said_that_was_not_measured():
    lost = on_points(125.0, velocity_peak_percent=math.nan), on_points(175.0)
    assert verdict(lost)[0].endswith("at Re 125, 175: no sound run at Re 125.")
    (text,) = verdict([on_points(125.0, offline_seconds=None)])
    assert "2,000 times faster" in text and "What making it took was not measured" in text
    assert "its time was not measured" in verdict([on_points(125.0, rom_seconds=None)])[0]
    assert verdict([]) == []
