"""Reduced runs kept on disk go on where they were cut short."""

from contextlib import contextmanager

import jax
import numpy as np
import pytest

from jaxsph.arrangements import Lattice
from jaxsph.io import read_trajectory
from jaxsph.scenes import taylor_green
from jaxsph_rom import Experiment, Study

EXPERIMENT = Experiment((100.0,), (100.0,), (2,))


class Cut(Exception):
    """What stops a run."""


@contextmanager
def cut_short(label, total, done):
    left = 2

    def report(steps):
        nonlocal left
        left -= 1
        if label.startswith("reduced") and not left:
            raise Cut

    yield report


def study(folder, **options):
    def make(reynolds):
        return taylor_green(16, reynolds, arrangement=Lattice(), end_time=0.06)

    return Study(make, folder, **options)


def test_a_reduced_run_that_was_cut_short_goes_on(tmp_path):
    with jax.enable_x64(True):
        with pytest.raises(Cut):
            list(study(tmp_path / "cut", progress=cut_short).run(EXPERIMENT))
        (path,) = (tmp_path / "cut" / "reduced").rglob("*.h5")
        before = read_trajectory(path)
        assert 1 < len(before.time) < 7
        (resumed,) = study(tmp_path / "cut").run(EXPERIMENT)
        (whole,) = study(tmp_path / "whole").run(EXPERIMENT)
    assert resumed.trajectory.coordinates.shape == (len(whole.trajectory.time), 2)
    count = len(before.time)
    np.testing.assert_array_equal(resumed.trajectory.coordinates[:count], before.coordinates)
    for name in ("time", "coordinates", "position", "density"):
        got, want = getattr(resumed.trajectory, name), getattr(whole.trajectory, name)
        np.testing.assert_allclose(got, want, rtol=1e-10, atol=1e-12)
