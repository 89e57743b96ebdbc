"""A reduced run is watched as it goes: pressure like no training run's, particles that clump."""

import json
import warnings
from contextlib import nullcontext

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import Fluid
from jaxsph.arrangements import Lattice
from jaxsph.integrate import FaultCode
from jaxsph.io import read_trajectory
from jaxsph.kept_run import kept_run
from jaxsph.scenes import lid_driven_cavity, taylor_green
from jaxsph.schemes import DeltaPlus
from jaxsph.simulate import first_doubt
from jaxsph_rom import Energy, Experiment, Galerkin, LatticePolynomials, ReducedModel, Study, pod
from jaxsph_rom.report import format_table
from jaxsph_rom.study import FAITHFUL, TrainedPressure

TIME = np.linspace(0.0, 1.0, 11)


def snapshots(strength):
    """(rho, u) of a decaying wave of pressure, range 2 strength at the start, and of its flow."""
    x = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    decay = np.exp(-TIME)
    flow = 0.1 * np.cos(x)[:, None] * decay
    return np.stack([1000.0 + strength * np.sin(x)[:, None] * decay**2, flow, 0.0 * flow], axis=1)


@pytest.fixture(scope="module")
def watch():
    fluid = Fluid(reference_density=1000.0, sound_speed=10.0, reference_speed=1.0)
    runs = [snapshots(1.0), snapshots(2.0)]
    basis = pod(np.concatenate(runs, axis=2), Energy(), fluid, modes=2)
    return TrainedPressure.of(basis, fluid, [(TIME, run) for run in runs])


def coordinates(watch, run, number):
    basis = watch.basis
    away = run[:, :, number] - np.asarray(basis.centre)
    return np.einsum("gfm,f,gf->m", basis.modes, basis.weights, away)


def test_training_runs_are_not_off_themselves_whatever_the_time(watch):
    for strength in (1.0, 2.0):
        for number in (0, 4, 10):
            found = coordinates(watch, snapshots(strength), number)
            assert watch.percent(TIME[number], found) == pytest.approx(0.0, abs=1e-6)
    # between two snapshots a decay is nearly straight
    middle = 0.5 * sum(coordinates(watch, snapshots(1.0), k) for k in (4, 5))
    assert watch.percent(0.45, middle) == pytest.approx(0.0, abs=1e-6)


def test_how_far_is_told_of_the_nearest_run_in_its_range(watch):
    # a wave of strength 3 is off that of strength 2 by <|sin|> = 2 / pi of 1, of a range of 4
    found = coordinates(watch, snapshots(3.0), 3)
    assert watch.percent(TIME[3], found) == pytest.approx(100.0 * 2.0 / np.pi / 4.0, rel=2e-2)
    far = coordinates(watch, snapshots(2.0 + 6.3), 3)
    assert watch.percent(TIME[3], far) == pytest.approx(100.0 * 2.0 / np.pi * 6.3 / 4.0, rel=2e-2)


def test_single_precision():
    fluid = Fluid(*(jnp.asarray(a, jnp.float32) for a in (1000.0, 10.0, 1.0)))
    run = snapshots(1.0).astype(np.float32)
    basis = pod(run, Energy(), fluid, modes=2)
    watch = TrainedPressure.of(basis, fluid, [(TIME, run)])
    found = coordinates(watch, run, 4).astype(np.float32)
    assert watch.percent(TIME[4], found) < 0.1  # a density of 1000 has seven digits, a range of 1


def test_noise_is_no_range(watch):
    quiet, loud = snapshots(1e-3), snapshots(3e-3)  # some 0.2 Pa, where rho0 U^2 is 1000 Pa
    still = TrainedPressure.of(watch.basis, watch.fluid, [(TIME, quiet)])
    assert still.percent(0.0, coordinates(watch, loud, 0)) < 2.0
    assert still.percent(0.0, coordinates(watch, snapshots(1.0), 0)) > 100.0


def test_what_is_off_by_more_than_its_range_is_named(watch):
    def said(strength):
        state = eqx.tree_at(lambda s: s.coordinates, snapshot, coordinates(watch, strength, 3))
        return watch(TIME[3], state)

    scene = taylor_green(12, arrangement=Lattice())
    snapshot = scene.model().observe(scene.state)
    snapshot = eqx.tree_at(
        lambda s: s.coordinates, snapshot, np.zeros(2), is_leaf=lambda leaf: leaf is None
    )
    assert said(snapshots(8.0)) is None  # 95 %
    assert "every training run by 111 % of its range" in said(snapshots(9.0))
    assert watch.percent(0.0, np.full(2, np.nan)) == np.inf


def test_a_doubt_is_warned_of_once_and_kept_though_the_run_is_cut_short(tmp_path):
    """Whether it shows before or after the cut."""
    scene = taylor_green(12, arrangement=Lattice(), end_time=0.11)
    times = scene.time_step * scene.steps_per_snapshot * np.arange(scene.schedule.intervals + 1)
    assert len(times) > 4

    class Cut(Exception):
        pass

    def watched_from(number):
        return lambda time, _: "too fast" if time > times[number] - 1e-9 else None

    def run(path, watch, after=None):
        left = [after]

        def report(steps):
            if left[0] is not None:
                left[0] -= 1
                if not left[0]:
                    raise Cut

        def restore(begun):
            return begun.state(-1)

        start, shown = (lambda _: scene.state), (lambda done: nullcontext(report))
        return kept_run(path, scene, scene.model, start, restore, shown, watch=watch)

    for number, cut in ((1, 3), (3, 2)):
        path, watch = tmp_path / f"{number}.h5", watched_from(number)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            with pytest.raises(Cut):
                run(path, watch, cut)
            found = run(path, watch)
        told = [str(w.message) for w in caught if "too fast" in str(w.message)]
        assert told == [f"t = {times[number]:.4g} s: too fast."]
        for metadata in (found.metadata, read_trajectory(path).metadata):
            assert metadata["doubt"] == "too fast"
            assert metadata["doubt_time"] == pytest.approx(times[number])
        assert first_doubt(watch, found)["doubt_time"] == pytest.approx(times[number])
    assert "doubt" not in run(tmp_path / "good.h5", lambda time, _: None).metadata


def test_particles_that_clump_are_a_fault():
    scene = taylor_green(12, arrangement=Lattice())
    points = np.asarray(scene.state.position)
    state = np.concatenate([scene.state.density[:, None], scene.state.velocity], axis=1)
    basis = pod(np.asarray(state)[:, :, None], Energy(), scene.fluid)
    functions = LatticePolynomials.fit(points, basis.functions.reshape(144, -1), scene.space)
    model = ReducedModel.of_scene(scene, basis, functions, Galerkin())
    spread = model.project(scene.state)

    @eqx.filter_jit
    def found(state):
        fault = model.inspect(jnp.asarray(3), state, model.prepare(state))
        return fault.code, fault.step, fault.particle

    for apart, code in ((0.11, FaultCode.NONE), (0.09, FaultCode.CLUMPED)):
        near = spread.position[5] + jnp.asarray([0.0, apart * scene.space.spacing])
        crowded = eqx.tree_at(lambda s: s.position, spread, spread.position.at[17].set(near))
        given, step, particle = found(crowded)
        assert int(given) == code
        if code:
            assert int(step) == 3 and int(particle) in (5, 17)


def cavity(end_time):
    def make(reynolds):
        lattice, scheme = Lattice(), DeltaPlus()
        return lid_driven_cavity(
            16, reynolds, end_time=end_time, arrangement=lattice, scheme=scheme
        )

    return make


def test_the_faithful_model_between_walls_is_never_called_stable(tmp_path):
    """It comes to its end here, and its velocity still looks well."""
    with pytest.warns(UserWarning, match="pressure is off that of every training run by 1"):
        (outcome,) = Study(cavity(0.7), tmp_path, FAITHFUL).run(
            Experiment((100.0,), (100.0,), (5,))
        )
    case = outcome.case
    assert case.fault is None and case.velocity_median_percent < 10.0
    assert not case.stable and not case.sound and case.time_ratio is None
    assert 0.4 < case.doubt_time < 0.7
    table = format_table([case])
    assert f"doubtful, {case.doubt_time:.3g} s" in table
    assert f"Re 100, M 5, galerkin: {case.doubt}" in table
    (path,) = (tmp_path / "reduced").rglob("*.h5")
    assert read_trajectory(path).metadata["doubt"] == case.doubt
    told = json.loads(json.dumps(case.to_dict()))
    assert not told["stable"] and told["doubt"] == case.doubt


@pytest.mark.slow
def test_the_faithful_model_between_walls_clumps(tmp_path):
    with pytest.warns(UserWarning, match="pressure is off"):
        (outcome,) = Study(cavity(2.0), tmp_path, FAITHFUL).run(
            Experiment((100.0,), (100.0,), (5,))
        )
    case = outcome.case
    assert "particles have clumped" in case.fault and case.fault_time < 2.0
    assert case.doubt_time < case.fault_time and "unstable, 1." in format_table([case])
