"""Velocity and pressure from the coordinates of solenoidal modes."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph.integrate import integrate
from jaxsph.scenes import lid_driven_cavity
from jaxsph.schemes import DeltaPlus
from jaxsph_rom import Energy
from jaxsph_rom.points import (
    Compressible,
    LinearClosure,
    ProjectedRun,
    Solenoidal,
    TracerModel,
    TracerState,
    fit_recovery,
    formulation_for,
    load,
    train,
)

RNG = np.random.default_rng(0)


def made(noise=0.0, runs=3, times=40):
    """Fields that are a linear and a quadratic function of coordinates."""
    lift = RNG.normal(size=(30, 2, 3))
    modes = np.linalg.qr(RNG.normal(size=(30, 2)))[0]
    linear, quadratic = RNG.normal(size=(2, 3)), RNG.normal(size=(2, 3, 3))
    fields, projected = [], []
    for _ in range(runs):
        a = RNG.normal(size=(times, 3))
        b = a @ linear.T + np.einsum("kmn,sm,sn->sk", quadratic, a, a) + 1.0
        density = 1000.0 + modes @ b.T + noise * RNG.normal(size=(30, times))
        velocity = np.einsum("gdm,sm->gds", lift, a)
        fields.append(np.concatenate([density[:, None], velocity], axis=1))
        projected.append(ProjectedRun(0.01, a))
    return fields, projected


@pytest.mark.parametrize("runs", [1, 3])
def test_a_quadratic_relation_is_found(runs):
    fields, projected = made(runs=runs)
    recovery = fit_recovery(fields, projected, [run.coordinates for run in projected], 2)
    a = jnp.asarray(RNG.normal(size=3))
    matrix, rest = recovery.combination(a)
    found = recovery.functions @ matrix + rest
    for truth, run in zip(fields, projected, strict=True):
        matrix, rest = jax.vmap(recovery.combination)(jnp.asarray(run.coordinates))
        again = np.moveaxis(np.asarray(recovery.functions @ matrix + rest), 0, -1)
        # the weakest regularisation tried is 1e-8
        np.testing.assert_allclose(again, truth, atol=1e-5)
    assert found.shape == (30, 3)


def test_noise_is_not_learnt():
    fields, projected = made(noise=0.5)
    recovery = fit_recovery(fields, projected, [run.coordinates for run in projected], 2)
    matrix, rest = jax.vmap(recovery.combination)(jnp.asarray(projected[0].coordinates))
    density = np.asarray(recovery.functions @ matrix + rest)[..., 0].T
    left = density - fields[0][:, 0]
    assert 0.4 < left.std() < 0.6  # what is left is the noise


def test_pressure_is_learnt_from_a_snapshot_on():
    fields, projected = made()
    for field in fields:
        field[:, 0, :5] = 1e6
    recovery = fit_recovery(fields, projected, [run.coordinates for run in projected], 2, first=5)
    assert np.abs(recovery.mean - 1000.0).max() < 50.0
    with pytest.raises(ValueError, match="no snapshot is left"):
        fit_recovery(fields, projected, [run.coordinates for run in projected], 2, first=40)


@pytest.fixture(scope="module")
def cavity():
    closure = LinearClosure(window=10, iterations=20)
    numbers = [{"reynolds": 50.0}, {"reynolds": 100.0}]
    trained = train(cavity_of, numbers, 4, formulation=Solenoidal(3), closure=closure)
    return trained, cavity_of(100.0)


def cavity_of(reynolds):
    return lid_driven_cavity(10, reynolds, end_time=0.4, scheme=DeltaPlus())


def test_a_flow_between_walls_is_solenoidal_and_follows_its_runs(cavity):
    trained, scene = cavity
    assert formulation_for(scene, Energy(), closed=False) == Solenoidal()
    assert formulation_for(scene, Energy(), closed=True) == Compressible(Energy())
    assert trained.training["formulation"] == "solenoidal"
    for run in trained.training["runs"]:
        error, floor = run["errors"], run["floor"]
        # a sudden start of ten particles across, four modes
        assert floor["velocity_peak_percent"] < 0.5 and error["velocity_median_percent"] < 4.0
        assert error["pressure_median_percent"] < 10.0
        assert error["pressure_peak_percent"] < 200.0  # where it rests nothing is judged


def test_it_is_kept_in_a_file(cavity, tmp_path):
    trained, _ = cavity
    trained.save(tmp_path / "flow.h5")
    found = load(tmp_path / "flow.h5")
    for name in ("velocity", "mean", "modes", "constant", "linear", "quadratic"):
        a, b = (getattr(t.flow.recovery, name) for t in (trained, found))
        np.testing.assert_array_equal(a, b)
    assert trained.flow.truncated(2).recovery is None
    assert eqx.tree_equal(found.functional.walls, trained.functional.walls)  # they keep tracers in


def test_fields_elsewhere_and_tracers_are_recovered_too(cavity):
    trained, scene = cavity
    prediction = trained.predict({"reynolds": 70.0})
    with pytest.raises(ValueError, match="member: 5; the prediction has 1"):
        prediction.fields(5)
    everywhere = prediction.fields(0)
    some = np.asarray(trained.flow.reference.points)[3:90:10]
    found = prediction.fields(0, some)
    np.testing.assert_allclose(found.velocity, everywhere.velocity[:, 3:90:10], atol=1e-8)
    np.testing.assert_allclose(found.pressure, everywhere.pressure[:, 3:90:10], atol=1e-6)
    model = TracerModel.of(trained.flow, jnp.asarray(1.0 / 70.0), scene.walls)
    start = TracerState(jnp.asarray(prediction.coordinates[0, 0]), jnp.asarray(some))
    step = jnp.asarray(trained.schedule.time_step)
    run = eqx.filter_jit(lambda m, s: integrate(m, s, jnp.asarray(0), step, 10, 2))
    _, fault, seen, _ = run(model, start)
    assert int(fault.code) == 0 and np.isfinite(seen.pressure).all()
    # after one interval they have hardly moved, and see what the field is where they are
    after = trained.flow.fields(seen.coordinates[:1], np.zeros(1), np.asarray(seen.position[0]))
    np.testing.assert_allclose(seen.velocity[0], after.velocity[0], atol=1e-9)
    np.testing.assert_allclose(seen.pressure[0], after.pressure[0], atol=1e-7)
