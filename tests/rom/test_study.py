"""A study with a centre that varies: splines carry it, and runs of other centres stay apart."""

import numpy as np

from jaxsph.arrangements import Lattice
from jaxsph.scenes import taylor_green
from jaxsph_rom import Energy, Experiment, MeanCentred, Study


def make(reynolds):
    return taylor_green(12, reynolds, arrangement=Lattice(), end_time=0.05)


def test_a_study_about_the_mean(tmp_path):
    experiment = Experiment((100.0,), (100.0,), (1, 2))
    study = Study(make, tmp_path, product=Energy(), centring=MeanCentred())
    outcomes = list(study.run(experiment))
    assert [o.case.inner_product for o in outcomes] == ["energy-meancentred"] * 2
    folders = sorted(p.name for p in (tmp_path / "reduced").iterdir())
    assert folders == ["energy-meancentred-100"]
    for outcome in outcomes:
        assert outcome.case.stable and outcome.trajectory.coordinates.shape[1] in (1, 2)
        # about the mean of so short a decay nothing is far
        assert outcome.case.velocity_peak_percent < 5.0
    basis = study.basis(experiment, 2)
    assert basis.centre.shape == basis.modes.shape[:2]
    own = Study(make, tmp_path, product=Energy()).basis(experiment, 2)
    np.testing.assert_allclose(own.centre, [[1000.0, 0.0, 0.0]])
