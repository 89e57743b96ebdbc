"""Which basis predicts at a parameter, and what it is trained on."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from jaxsph_rom import Experiment, LocalBases

PAPER = LocalBases((50.0, 100.0, 150.0, 200.0))


@pytest.mark.parametrize(
    "reynolds, interval",
    [
        (50.0, 0),
        (75.0, 0),
        (100.0 - 1e-9, 0),
        (np.nextafter(100.0, 0.0), 0),  # the last number before the border
        (100.0, 1),
        (np.nextafter(100.0, 200.0), 1),
        (100.0 + 1e-9, 1),
        (np.nextafter(150.0, 0.0), 1),
        (150.0 - 1e-9, 1),
        (150.0, 2),
        (150.0 + 1e-9, 2),
        (200.0 - 1e-9, 2),
        (200.0, 2),  # the last interval is closed
        (100, 1),
    ],
)
def test_borders_from_both_sides(reynolds, interval):
    assert PAPER.interval(reynolds) == interval


@pytest.mark.parametrize("reynolds", [50.0 - 1e-9, 200.0 + 1e-9, -75.0, float("inf"), float("nan")])
def test_outside_is_refused_with_the_range_that_is_covered(reynolds):
    with pytest.raises(ValueError, match=r"parameter: .* is outside \[50, 200\]") as caught:
        PAPER.interval(reynolds)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(f"parameter: {reynolds:.12g}")  # 200 + 1e-9 is not "200"


@given(st.floats(50.0, 200.0))
def test_exactly_one_interval_holds_a_parameter(reynolds):
    inside = [low <= reynolds < high for low, high in ((50, 100), (100, 150), (150, 200))]
    inside[2] |= reynolds == 200.0
    assert inside == [number == PAPER.interval(reynolds) for number in range(3)]


def test_a_run_at_a_border_trains_both_sides_and_order_is_kept():
    trained = PAPER.training((200.0, 150.0, 100.0, 75.0, 50.0))
    assert trained == ((100.0, 75.0, 50.0), (150.0, 100.0), (200.0, 150.0))


def test_one_interval_is_a_global_basis():
    assert LocalBases((50.0, 200.0)).training((50.0, 200.0)) == ((50.0, 200.0),)
    assert LocalBases((50.0, 200.0)).interval(200.0) == 0


def test_an_interval_without_training_is_refused():
    with pytest.raises(ValueError, match=r"training: none of \(50, 75, 160\) is in \[100, 150\]"):
        PAPER.training((50.0, 75.0, 160.0))
    with pytest.raises(ValueError, match=r"parameter: 250 is outside"):
        PAPER.training((50.0, 100.0, 150.0, 250.0))


@pytest.mark.parametrize(
    "borders",
    [(), (50.0,), (50.0, 50.0), (100.0, 50.0), (50.0, 150.0, 100.0), (50.0, float("nan"), 100.0)],
)
def test_borders_that_do_not_increase_are_refused(borders):
    with pytest.raises(ValueError, match="borders: got .* increasing order"):
        LocalBases(borders)


def test_experiments_are_split_by_where_they_predict():
    trained = (50.0, 100.0, 150.0, 200.0)
    split = PAPER.experiments(trained, (180.0, 75.0, 100.0, 200.0, 60.0), (5, 10))
    assert split == (
        Experiment((50.0, 100.0), (75.0, 60.0), (5, 10)),
        Experiment((100.0, 150.0), (100.0,), (5, 10)),
        Experiment((150.0, 200.0), (180.0, 200.0), (5, 10)),
    )


def test_an_interval_in_which_nothing_is_predicted_needs_no_training():
    assert PAPER.experiments((50.0, 100.0), (75.0,), (5,)) == (
        Experiment((50.0, 100.0), (75.0,), (5,)),
    )
    assert PAPER.experiments((50.0, 100.0), (), (5,)) == ()
    with pytest.raises(ValueError, match=r"none of \(50, 75\) is in \[100, 150\]"):
        PAPER.experiments((50.0, 75.0), (100.0,), (5,))
    with pytest.raises(ValueError, match="parameter: 210 is outside"):
        PAPER.experiments((50.0, 100.0), (75.0, 210.0), (5,))
