"""A study with a centre that varies: splines carry it, and runs of other centres stay apart."""

import numpy as np
import pytest

from jaxsph.arrangements import Lattice
from jaxsph.scenes import taylor_green
from jaxsph_rom import Experiment, MeanCentred, OnParticles, OnPoints, Study
from jaxsph_rom.study import study as study_module


def make(reynolds):
    return taylor_green(12, reynolds, arrangement=Lattice(), end_time=0.05)


def test_a_study_about_the_mean(tmp_path):
    experiment = Experiment((100.0,), (100.0,), (1, 2))
    method = OnParticles(centring=MeanCentred())
    study = Study(make, tmp_path, method)
    outcomes = list(study.run(experiment))
    assert [o.case.inner_product for o in outcomes] == ["energy-meancentred"] * 2
    folders = sorted(p.name for p in (tmp_path / "reduced").iterdir())
    assert folders == ["energy-meancentred-modes-quadratic-100"]
    state = make(100.0).state
    start = np.concatenate([state.density[:, None], state.velocity], axis=1)
    for outcome, modes in zip(outcomes, (1, 2), strict=True):
        assert outcome.case.stable
        # particles start on the reference points, where splines are exact and modes orthonormal
        basis = method.basis(study.runs, experiment, modes)
        change = start - basis.centre
        coordinates = np.einsum("gfm,f,gf->m", basis.modes, basis.weights, change)
        wanted = basis.centre + basis.modes @ coordinates
        found = outcome.trajectory
        np.testing.assert_allclose(found.coordinates[0], coordinates, atol=1e-8)
        np.testing.assert_allclose(found.density[0], wanted[:, 0], atol=1e-8)
        np.testing.assert_allclose(found.velocity[0], wanted[:, 1:], atol=1e-9)
    assert basis.centre.shape == basis.modes.shape[:2]
    own = OnParticles().basis(study.runs, experiment, 2)
    np.testing.assert_allclose(own.centre, [[1000.0, 0.0, 0.0]])


@pytest.mark.parametrize("method", [OnPoints(), OnParticles()], ids=["points", "particles"])
def test_models_have_the_floor_of_their_basis_beside_them(tmp_path, method):
    study = Study(make, tmp_path, method)
    one, two = study.run(Experiment((100.0,), (100.0,), (1, 2)))
    for outcome in (one, two):
        found = outcome.velocity_percent, outcome.pressure_percent
        for percent, floor in zip(found, outcome.floor, strict=True):
            assert floor.shape == percent.shape == outcome.time.shape
            assert floor[0] == pytest.approx(percent[0], rel=1e-6)  # where a run starts
    # the second mode of a decay holds what the first leaves
    assert np.median(two.floor[0]) < np.median(one.floor[0])
    assert np.median(two.floor[0]) < 1.01 * np.median(two.velocity_percent)


def test_a_map_that_does_not_fit_is_met_before_a_run(tmp_path):
    study = Study(lambda re: taylor_green(11, re, arrangement=Lattice(), end_time=0.05), tmp_path)
    with pytest.raises(ValueError, match="three kernel supports"):
        next(study.run(Experiment((100.0,), (100.0,), (1,))))
    assert not list(tmp_path.iterdir())


def test_a_field_that_is_uniform_at_the_start_has_a_discrepancy():
    reference = np.array([[5.0, 5.0, 5.0], [1.0, 2.0, 5.0]])
    found = study_module._percent(reference, reference + 0.04)
    np.testing.assert_allclose(found, [1.0, 1.0])  # of a spread of 4
    np.testing.assert_array_equal(study_module._percent(0.0 * reference, reference), 0.0)
