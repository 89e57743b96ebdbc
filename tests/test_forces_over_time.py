"""Forces on walls as means over time: momentum kept, parts, derivatives, runs taken up again."""

import dataclasses

import h5py
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxsph
from jaxsph import ForcesOverTime, WallForces
from jaxsph.integrate import integrate
from jaxsph.io import read_overview, read_trajectory
from jaxsph.scenes import hydrostatic_tank
from jaxsph.schemes import DeltaPlus
from jaxsph.wall_forces import named
from tests.test_wall_forces import GRAVITY, conserving, stirred, vessel

FIRST, STEP, STEPS = jnp.asarray(0), 1e-3, 4


@pytest.fixture(scope="module")
def scene():
    scene = conserving(vessel(DeltaPlus()))
    return dataclasses.replace(scene, state=stirred(scene), steps_per_snapshot=STEPS, end_time=0.02)


@pytest.fixture(scope="module")
def model(scene):
    return ForcesOverTime(scene.model(), WallForces.of(scene))


@pytest.fixture(scope="module")
def run(model):
    """Start -> the end of some steps."""
    return jax.jit(lambda start: integrate(model, start, FIRST, jnp.asarray(STEP), STEPS, 1)[0])


def test_impulse_is_what_the_fluid_loses(scene, model, run):
    end = run(model.start(scene.state))
    mass, seconds = float(scene.mass), STEP * STEPS
    gained = mass * np.asarray(end.particles.velocity - scene.state.velocity).sum(axis=0)
    weight = np.array([0.0, -GRAVITY * mass * len(scene.state.position)])
    impulse, largest = end.impulse.force, float(jnp.abs(end.impulse.force).max())
    # round-off of some thousand terms in each of 16 stages
    np.testing.assert_allclose(impulse[0] + gained, weight * seconds, atol=1e-10 * largest)
    assert np.abs(impulse[1]).max() > 1e-3 * largest, "a force on the ball that is there"


def test_mean_is_that_of_every_step(scene, model, run):
    """By the trapezoidal rule over the forces at each step's start and end."""
    end, instants, state = run(model.start(scene.state)), [], scene.state
    plain = model.model
    one = jax.jit(lambda y: integrate(plain, y, FIRST, jnp.asarray(STEP), 1, 1)[0])
    for number in range(STEPS + 1):
        time = jnp.asarray(number * STEP)
        instants.append(model.forces(plain, time, state)[0]["ball"])
        state = one(state)
    mean = end.means(model.forces.names, STEP * STEPS)[0]["ball"]
    expected = np.trapezoid(np.array(instants), dx=STEP, axis=0) / (STEP * STEPS)
    spread = np.ptp(np.array(instants), axis=0).max()
    # second order in the step, of a force that sound changes within it
    np.testing.assert_allclose(mean, expected, atol=0.05 * spread)


def test_means_are_differentiable(scene, model, run):
    way = jax.tree.map(lambda a: 1e-3 * jax.random.normal(jax.random.key(3), a.shape), scene.state)

    def drag(step):
        moved = jax.tree.map(lambda a, d: a + step * d, scene.state, way)
        return run(model.start(moved)).impulse.force[1, 0]

    slope = float(jax.jvp(drag, (jnp.zeros(()),), (jnp.ones(()),))[1])
    step = 1e-4
    difference = float((drag(step) - drag(-step)) / (2.0 * step))
    assert slope == pytest.approx(difference, rel=1e-5)  # second order and round-off of the step


def test_run_taken_up_again_has_the_means_of_an_unbroken_one(scene, tmp_path):
    path, whole = tmp_path / "run.h5", jaxsph.run_scene(scene, tmp_path / "whole.h5")

    class Killed(Exception):
        pass

    def kill(steps, done=[0]):  # noqa: B006
        done[0] += steps
        if done[0] >= 2 * STEPS:
            raise Killed

    with pytest.raises(Killed):
        jaxsph.run_scene(scene, path, progress=kill)
    again = jaxsph.run_scene(scene, path)
    for kind in ("mean_forces", "mean_torques"):
        for name in ("walls", "ball", "bottom"):
            np.testing.assert_array_equal(getattr(again, kind)[name], getattr(whole, kind)[name])
    np.testing.assert_array_equal(again.forces["ball"], whole.forces["ball"])
    with h5py.File(path, "r") as file:
        assert file["mean_forces/ball"].shape == (len(whole.time), 2)
        drag = file["forces/ball"].attrs["drag_coefficient"]
    mean = whole.mean_forces["ball"][whole.time > 0.8 * whole.time[-1] + 1e-9].mean(axis=0)
    assert drag == pytest.approx(2.0 * mean[0] / (1000.0 * 0.5**2 * 0.4))
    told = read_overview(path).forces["ball"]
    np.testing.assert_allclose(told["mean_force"], mean)
    # the first are those of the start itself
    np.testing.assert_array_equal(whole.mean_forces["ball"][0], whole.forces["ball"][0])
    copy = read_trajectory(whole.save(tmp_path / "copy.h5"))
    np.testing.assert_array_equal(copy.mean_torques["ball"], whole.mean_torques["ball"])


def test_the_last_fifth_is_weighed_by_time(tmp_path):
    """Seven intervals: 0.4 of the sixth and the seventh; of instants those that lie in it."""
    time, at = np.arange(8.0), np.zeros((8, 1, 2))
    force = np.stack([10.0 * time**2, time], axis=1)
    told = {}
    for name, means in (("means", {"walls": force}), ("instants", {})):
        run = jaxsph.Trajectory(
            time, at, at, at[:, :, 0], at[:, :, 0], forces={"walls": force},
            torques={"walls": time}, mean_forces=means, mean_torques={k: time for k in means},
        )  # fmt: skip
        told[name] = read_overview(run.save(tmp_path / f"{name}.h5")).forces["walls"]
    wanted = (0.4 * force[6] + force[7]) / 1.4
    np.testing.assert_allclose(told["means"]["mean_force"], wanted, rtol=1e-14)
    assert told["means"]["mean_torque"] == pytest.approx((0.4 * 6.0 + 7.0) / 1.4)
    np.testing.assert_allclose(told["instants"]["mean_force"], force[6:].mean(axis=0))


def test_only_named_parts_are_followed_over_time():
    tank = WallForces.of(hydrostatic_tank(16))
    assert named(tank) is None and named(None) is None
    forces = WallForces.of(vessel(DeltaPlus()))
    assert named(forces) is forces
