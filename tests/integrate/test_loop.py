"""The time loop: order, faults and derivatives, on a user's own model and on the full one."""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

from jaxsph import FullModel, Schedule, SimulationError, Snapshot, simulate
from jaxsph.arrangements import JitteredLattice, Lattice
from jaxsph.effects import Continuity, LaminarViscosity, PressureForce
from jaxsph.integrate import Fault, FaultCode, Model, integrate
from jaxsph.scenes import lid_driven_cavity, taylor_green
from jaxsph.schemes import DeltaPlus

NEVER = 1e9


class Oscillators(Model):
    """x'' = -w^2 x + cos t for two particles in the plane; NaN from `failure` [s] on."""

    frequency: Array
    failure: Array  # one time for each particle

    def rates(self, time, state, auxiliary):
        x, v = state
        force = jnp.where(time > self.failure, jnp.nan, jnp.cos(time))
        return v, force[:, None] - self.frequency**2 * x

    def inspect(self, step, state, auxiliary):
        wild = ~jnp.isfinite(state[1]).all(1)
        return Fault.first_of(step, (FaultCode.NOT_FINITE, jnp.any(wild), jnp.argmax(wild)))

    def observe(self, state):
        nothing = jnp.zeros(state[0].shape[0])
        return Snapshot(state[0], state[1], nothing, nothing)


def oscillators(frequency=2.0, failure=(NEVER, NEVER)):
    return Oscillators(jnp.asarray(frequency), jnp.asarray(failure))


def at_rest_at_one():
    return jnp.ones((2, 2)), jnp.zeros((2, 2))


def exact(t):
    """For w = 2: x = 2/3 cos 2t + 1/3 cos t."""
    return 2.0 / 3.0 * np.cos(2.0 * t) + np.cos(t) / 3.0


@partial(jax.jit, static_argnums=(4, 5))
def run(model, state, first_step, time_step, steps_per_snapshot, snapshots):
    return integrate(model, state, first_step, time_step, steps_per_snapshot, snapshots)


def start(model, time_step, steps_per_snapshot, snapshots, state=None, first_step=0):
    state = at_rest_at_one() if state is None else state
    return run(model, state, first_step, jnp.asarray(time_step), steps_per_snapshot, snapshots)


def test_order_four():
    steps = np.asarray([20, 40, 80, 160])
    errors = []
    for n in steps:
        (x, v), fault, _, _ = start(oscillators(), 2.0 / n, int(n), 1)
        assert int(fault.code) == FaultCode.NONE
        speed = -4.0 / 3.0 * np.sin(4.0) - np.sin(2.0) / 3.0
        errors.append(np.hypot(x[0, 0] - exact(2.0), v[0, 0] - speed))
    slope = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(4.0, abs=0.1)  # w dt up to 0.2: the next order bends it a little


def test_snapshots_after_each_interval():
    (x, _), _, snapshots, good = start(oscillators(), 0.02, 5, 10)
    assert snapshots.position.shape == (10, 2, 2) and good.shape == (10,)
    times = 0.1 * np.arange(1, 11)
    found = np.asarray(snapshots.position)
    # RK4's error of w^5 dt^4 t / 120 = 4e-8 in phase
    np.testing.assert_allclose(found, np.broadcast_to(exact(times)[:, None, None], found.shape),
                               atol=1e-7)  # fmt: skip
    np.testing.assert_array_equal(snapshots.position[-1], x)
    assert np.all(good)


def test_a_run_that_starts_from_a_snapshot_repeats_the_rest_bit_by_bit():
    _, _, whole, _ = start(oscillators(), 0.02, 5, 4)
    halfway = (whole.position[1], whole.velocity[1])
    _, _, rest, _ = start(oscillators(), 0.02, 5, 2, halfway, first_step=10)
    np.testing.assert_array_equal(rest.position, whole.position[2:])
    np.testing.assert_array_equal(rest.velocity, whole.velocity[2:])


class Frozen(Oscillators):
    """y' = the state when the auxiliary structure was prepared; `finish` counts steps in v."""

    def prepare(self, state):
        return state[0]

    def rates(self, time, state, auxiliary):
        return auxiliary, jnp.zeros_like(state[1])

    def finish(self, state):
        return state[0], state[1] + 1.0


def test_the_auxiliary_structure_is_prepared_once_an_interval():
    model = Frozen(jnp.asarray(0.0), jnp.asarray([NEVER, NEVER]))
    (x, count), _, _, _ = start(model, 0.1, 5, 3)
    np.testing.assert_allclose(x, 1.5**3, rtol=1e-14)  # three Euler steps of 0.5; round-off
    np.testing.assert_array_equal(count, 15.0)  # each step is finished once


@pytest.mark.parametrize("make, sorts", [(taylor_green, 1), (lid_driven_cavity, 4)])
def test_a_full_model_s_program_makes_its_list_in_one_place(make, sorts):
    """Particles are sorted once; with walls those near them are found, they and ghosts sorted."""
    scene = make(16)
    model, step = scene.model(), jnp.asarray(scene.time_step)
    run = jax.jit(lambda state: integrate(model, state, np.int32(0), step, 2, 2))
    assert run.lower(scene.state).as_text().count("stablehlo.sort") == sorts


# ------------------------------------------------------------------ faults


def fails_in(step, time_step=0.02):
    """A time between the first and the second stage of a step."""
    return (step - 0.75) * time_step


def test_a_nan_is_named_with_step_and_particle_and_the_last_good_state_stays():
    sound, _, _, _ = start(oscillators(), 0.02, 1, 7)
    failing = oscillators(failure=(NEVER, fails_in(8)))
    state, fault, snapshots, good = start(failing, 0.02, 5, 3)
    assert (int(fault.code), int(fault.step), int(fault.particle)) == (FaultCode.NOT_FINITE, 8, 1)
    for kept, expected in zip(state, sound, strict=True):
        np.testing.assert_allclose(kept, expected, rtol=1e-15)  # step 7's, compiled otherwise
    np.testing.assert_array_equal(good, [True, False, False])
    assert np.all(np.isfinite(snapshots.position))


@pytest.mark.parametrize("step", [1, 5, 6, 15])
def test_faults_at_the_edges_of_intervals(step):
    _, fault, _, good = start(oscillators(failure=(fails_in(step), NEVER)), 0.02, 5, 3)
    assert (int(fault.step), int(fault.particle)) == (step, 0)
    np.testing.assert_array_equal(good, 5 * np.arange(1, 4) < step)


def test_the_first_of_several_checks_counts():
    fault = Fault.first_of(
        jnp.asarray(3),
        (FaultCode.NOT_FINITE, jnp.asarray(False), 4),
        (FaultCode.NEIGHBOR_OVERFLOW, jnp.asarray(True), -1),
        (FaultCode.NEIGHBORS_OUTDATED, jnp.asarray(True), 6),
    )
    assert int(fault.code) == FaultCode.NEIGHBOR_OVERFLOW
    assert (int(fault.step), int(fault.particle)) == (3, -1)


def test_a_member_that_blows_up_leaves_the_others_alone():
    failures = jnp.asarray([[NEVER, NEVER], [fails_in(8), NEVER], [NEVER, NEVER]])

    def member(failure):
        model = Oscillators(jnp.asarray(2.0), failure)
        return integrate(model, at_rest_at_one(), 0, jnp.asarray(0.02), 5, 3)

    state, fault, snapshots, good = jax.jit(jax.vmap(member))(failures)
    np.testing.assert_array_equal(fault.code, [0, FaultCode.NOT_FINITE, 0])
    np.testing.assert_array_equal(fault.step, [-1, 8, -1])
    np.testing.assert_array_equal(good, [[True] * 3, [True, False, False], [True] * 3])
    alone, _, _, _ = start(oscillators(), 0.02, 5, 3)
    for k in (0, 2):
        np.testing.assert_allclose(state[0][k], alone[0], rtol=1e-14)  # fused otherwise
    assert np.all(np.isfinite(snapshots.position[1]))


# ------------------------------------------------------------------ derivatives


def test_derivatives_through_the_loop():
    def final(frequency, position):
        model = Oscillators(frequency, jnp.asarray([NEVER, NEVER]))
        state = (position, jnp.zeros_like(position))
        (x, v), _, _, _ = integrate(model, state, 0, jnp.asarray(0.05), 5, 4)
        return jnp.sum(x**2) + jnp.sum(v**3)

    at = (jnp.asarray(2.0), jnp.asarray([[1.0, 0.5], [-0.3, 0.2]]))
    way = (jnp.asarray(0.7), jnp.asarray([[0.2, -1.0], [0.4, 0.1]]))
    gradient = jax.jit(jax.grad(final, argnums=(0, 1)))(*at)
    slope = jax.jit(lambda: jax.jvp(final, at, way)[1])()
    evaluate, h = jax.jit(final), 1e-6
    ends = [evaluate(*(a + s * w for a, w in zip(at, way, strict=True))) for s in (h, -h)]
    backward = gradient[0] * way[0] + jnp.sum(gradient[1] * way[1])
    np.testing.assert_allclose(backward, slope, rtol=1e-13)  # round-off
    # truncation h^2, round-off 1e-16 / h
    np.testing.assert_allclose(slope, (ends[0] - ends[1]) / (2.0 * h), rtol=1e-8)


# ------------------------------------------------------------------ the full model


class Tape:
    """A recorder that keeps what it is given."""

    def __init__(self):
        self.steps, self.snapshots = [], []

    def append(self, step, time, snapshot):
        self.steps.append(step)
        self.snapshots.append(snapshot)


def straight_flight():
    """Particles without effects: what they do is known."""
    scene = taylor_green(12, arrangement=Lattice())
    return eqx.tree_at(lambda s: s.effects, scene, ())


def fly(state, scene, steps=20, **options):
    return simulate(scene.model(margin=1.0), state, Schedule(0.01, 2, steps // 2), **options)


def with_value(state, name, row, value):
    field = getattr(state, name)
    return eqx.tree_at(lambda s: getattr(s, name), state, field.at[row].set(value))


def test_clumping_in_mid_run_is_reported_as_overflow(monkeypatch):
    monkeypatch.setattr(FullModel, "enlarged", lambda self: None)
    scene = straight_flight()
    x = scene.state.position
    inward = eqx.tree_at(lambda s: s.velocity, scene.state, -0.5 * jnp.sin(2 * jnp.pi * x))
    tape = Tape()
    with pytest.raises(SimulationError, match="more neighbours than the list holds") as caught:
        fly(inward, scene, recorder=tape)
    assert caught.value.code == FaultCode.NEIGHBOR_OVERFLOW
    assert caught.value.step > 2, "the start fitted"
    # what was recorded before is whole, and ends in the interval before the fault
    assert tape.steps == list(range(0, caught.value.step, 2))
    for step, snapshot in zip(tape.steps, tape.snapshots, strict=True):
        flown = scene.space.box.wrap(x + 0.01 * step * inward.velocity)
        np.testing.assert_allclose(snapshot.position, flown, atol=1e-14)  # round-off


def test_the_list_is_rebuilt_within_an_interval_before_it_is_outrun():
    scene = straight_flight()
    wind = jnp.full_like(scene.state.velocity, 1.0)
    state = eqx.tree_at(lambda s: s.velocity, scene.state, wind)
    model = scene.model()
    neighbors, dt = model.prepare(state), jnp.asarray(0.01)
    ahead = eqx.tree_at(lambda s: s.position, state, state.position + 0.4 * model.search.skin)
    same, new = (model.refresh(neighbors, s, dt) for s in (state, ahead))
    np.testing.assert_array_equal(same.reference, state.position)
    np.testing.assert_array_equal(new.reference, ahead.position)
    # 0.2 m of way in one interval, many times half the skin of 0.65 dx = 0.054 m: no fault
    flown = simulate(model, state, Schedule(0.01, 20, 1))
    expected = scene.space.box.wrap(state.position + 0.2)
    np.testing.assert_allclose(flown.position[-1], expected, atol=1e-13)  # round-off


@pytest.mark.parametrize("row", [0, 77])
def test_motion_beyond_the_skin_is_reported(row):
    scene = straight_flight()
    # a step of 0.05 m against a skin of 0.65 dx = 0.054 m, half of which a particle may go
    state = with_value(scene.state, "velocity", row, jnp.asarray([0.0, 5.0]))
    with pytest.raises(SimulationError, match=rf"step 1 \(t = 0.01 s, particle {row}\)") as caught:
        fly(state, scene)
    assert caught.value.code == FaultCode.NEIGHBORS_OUTDATED
    assert (caught.value.step, caught.value.particle) == (1, row)


@pytest.mark.parametrize(
    "name, value, code, step",
    [
        ("density", 1201.0, FaultCode.DENSITY_OUT_OF_BOUNDS, 1),
        ("density", 799.0, FaultCode.DENSITY_OUT_OF_BOUNDS, 1),
        ("density", -1000.0, FaultCode.DENSITY_OUT_OF_BOUNDS, 1),
        ("density", np.inf, FaultCode.NOT_FINITE, 0),  # found before it is recorded
        ("velocity", np.nan, FaultCode.NOT_FINITE, 0),
        ("position", np.nan, FaultCode.NOT_FINITE, 0),
    ],
)
def test_wild_values_are_reported_with_their_particle(name, value, code, step):
    scene = straight_flight()
    with pytest.raises(SimulationError, match="particle 42") as caught:
        fly(with_value(scene.state, name, 42, value), scene)
    assert (caught.value.code, caught.value.step, caught.value.particle) == (code, step, 42)


@pytest.mark.parametrize("steps", [0, -2])
def test_no_steps_raise(steps):
    scene = straight_flight()
    with pytest.raises(ValueError, match="first_step: from 0 to|intervals: at least 0"):
        fly(scene.state, scene, steps=steps)


@pytest.fixture(scope="module")
def vortices():
    """With three effects only: derivatives of all sums are tested with the pair sum."""
    scene = taylor_green(12, arrangement=JitteredLattice(0.1), scheme=DeltaPlus())
    kinds = Continuity | PressureForce | LaminarViscosity
    kept = tuple(e for e in scene.effects if isinstance(e, kinds))
    return eqx.tree_at(lambda s: s.effects, scene, kept)


@pytest.fixture(scope="module")
def energy(vortices):
    """Mean squared speed after four steps as a function of viscosity and initial velocity."""
    model = vortices.model(margin=1.3)
    assert isinstance(model, FullModel)
    (place,) = (k for k, e in enumerate(vortices.effects) if isinstance(e, LaminarViscosity))

    def function(viscosity, velocity):
        moved = eqx.tree_at(lambda m: m.functional.effects[place].viscosity, model, viscosity)
        state = eqx.tree_at(lambda s: s.velocity, vortices.state, velocity)
        dt = jnp.asarray(vortices.time_step)
        state, fault, _, _ = integrate(moved, state, 0, dt, 2, 2)
        return jnp.mean(state.velocity**2), fault.code

    return function


def test_derivatives_through_the_full_model(vortices, energy):
    at = (jnp.asarray(0.01), vortices.state.velocity)
    noise = np.random.default_rng(0).normal(size=at[1].shape)
    way = (jnp.asarray(0.01), jnp.asarray(noise))

    @jax.jit
    def derivatives(at, way):
        slope = jax.jvp(lambda *a: energy(*a)[0], at, way)[1]
        return slope, jax.grad(energy, argnums=(0, 1), has_aux=True)(*at)[0]

    slope, gradient = derivatives(at, way)
    evaluate, h = jax.jit(energy), 1e-5
    ends = [evaluate(*(a + s * w for a, w in zip(at, way, strict=True))) for s in (h, -h)]
    assert all(int(code) == FaultCode.NONE for _, code in ends)
    backward = gradient[0] * way[0] + jnp.sum(gradient[1] * way[1])
    np.testing.assert_allclose(backward, slope, rtol=1e-11)  # round-off of 16 stages
    # truncation h^2 times curvature, round-off 1e-16 / h against a slope of order 1e-2
    np.testing.assert_allclose(slope, (ends[0][0] - ends[1][0]) / (2.0 * h), rtol=1e-6)
    assert float(gradient[0]) < 0.0, "more viscosity, less energy"


def test_vmap_over_viscosity_equals_separate_runs(vortices, energy):
    def function(viscosity):
        return energy(viscosity, vortices.state.velocity)

    viscosities = jnp.asarray([0.005, 0.02])
    one = jax.jit(function)
    separate = jnp.stack([one(nu)[0] for nu in viscosities])
    together, codes = jax.jit(jax.vmap(function))(viscosities)
    np.testing.assert_array_equal(codes, [FaultCode.NONE] * 2)
    np.testing.assert_allclose(together, separate, rtol=1e-12)  # round-off
    assert separate[0] > separate[1]
