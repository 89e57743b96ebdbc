"""Particles at any places whatever: finite, or a named fault, and no NaN in a file."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from benchmarks.hard_cases.bounds import SCATTERED
from benchmarks.hard_cases.judge import Case, Ending, complaints, run_case
from benchmarks.hard_cases.spoilt_cases import RANDOM_PARTICLES, random_start

SIDE = round(RANDOM_PARTICLES**0.5)
LATTICE = (np.stack(np.meshgrid(*(np.arange(SIDE),) * 2), -1).reshape(-1, 2) + 0.5) / SIDE
INSIDE = st.floats(0.0, 1.0, exclude_max=True)


@pytest.mark.filterwarnings("ignore:.*allocated it anew")
@settings(max_examples=30)
@given(places=arrays(float, (RANDOM_PARTICLES, 2), elements=INSIDE), disorder=st.floats(0.0, 1.0))
@example(places=np.zeros((RANDOM_PARTICLES, 2)), disorder=1.0)
@example(places=np.zeros((RANDOM_PARTICLES, 2)), disorder=0.999)
def test_random_starts_stay_bounded_or_are_named(places, disorder):
    """From the lattice (no disorder) to the places drawn (1), and on the way between."""

    def make():
        return random_start(LATTICE + disorder * (places - LATTICE))

    endings = (Ending.FINISHED, Ending.FAULT)
    case = Case("start/random", "random places", make, SCATTERED, endings=endings)
    assert not complaints(case, run_case(case))
