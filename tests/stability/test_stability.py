"""A blow-up, an overflow or a NaN is prevented or named, and never recorded as a result."""

import pytest

from benchmarks.hard_cases.cases import CASES
from benchmarks.hard_cases.judge import complaints, run_case


def _marked(case):
    marks = [pytest.mark.slow] if case.slow else []
    if case.wrong:
        marks.append(pytest.mark.xfail(strict=True, reason=case.wrong))
    return pytest.param(case, id=case.name, marks=marks)


@pytest.mark.filterwarnings("ignore:.*allocated it anew")  # as intended; the table counts them
@pytest.mark.parametrize("case", [_marked(case) for case in CASES.values()])
def test_stays_within_bounds_or_is_named(case):
    assert not complaints(case, run_case(case))
