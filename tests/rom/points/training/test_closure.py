"""A closure learns what is missing from a system, and what it cannot learn is refused."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph_rom.points import ProjectedRun, QuadraticSystem, fit_linear_closure, rollout

STEP, EACH, SNAPSHOTS = 0.01, 2, 60
FIRST = jnp.asarray([1.0, 0.2, -0.1])


def oscillator(damping=0.5):
    """An oscillation beside a decay, coupled by an energy-neutral quadratic term."""
    linear = jnp.asarray([[[0.0, 0.0, 0.0], [0.0, 0.0, 3.0], [0.0, -3.0, 0.0]], -20.0 * jnp.eye(3)])
    linear = linear.at[1, 0, 0].multiply(damping)
    carried = np.zeros((3, 3, 3))
    carried[0, 1, 1], carried[1, 0, 1] = 0.5, -0.5  # mode 1 carries
    quadratic = 0.5 * (carried + carried.transpose(0, 2, 1))
    return QuadraticSystem(jnp.zeros((2, 3)), linear, jnp.asarray(quadratic))


def run(system, viscosity):
    after = rollout(system, FIRST, jnp.asarray(viscosity), STEP, EACH, SNAPSHOTS)
    return ProjectedRun(viscosity, np.concatenate([FIRST[None], after]))


def apart(system, wanted):
    after = rollout(system, FIRST, jnp.asarray(wanted.values), STEP, EACH, SNAPSHOTS)
    return float(np.abs(after - wanted.coordinates[1:]).max())


def test_missing_viscosity_is_found_between_the_runs():
    truth, wrong = oscillator(damping=0.5), oscillator(damping=0.55)
    runs = [run(truth, viscosity) for viscosity in (0.01, 0.02)]
    unseen = run(truth, 0.015)
    fitted = fit_linear_closure(wrong, runs, STEP, EACH, window=20, iterations=400)
    assert apart(fitted.system, unseen) < 0.05 * apart(wrong, unseen)
    assert fitted.training[-1] < 1e-3 * fitted.training[0] and fitted.validation is None
    # explicit in the viscosity, so that what is found is the damping itself
    found = fitted.system.linear[1, 0, 0] - wrong.linear[1, 0, 0]
    assert float(found) == pytest.approx(1.0, rel=0.3)  # 20 (0.55 - 0.5)


def test_the_iteration_that_does_best_on_the_held_back_run_is_kept():
    truth, wrong = oscillator(0.5), oscillator(0.55)
    runs, held_back = [run(truth, 0.01)], run(truth, 0.03)
    done = []
    fitted = fit_linear_closure(
        wrong, runs, STEP, EACH, held_back=held_back, window=20, iterations=100,
        progress=done.append,
    )  # fmt: skip
    assert sum(done) == 100 and len(fitted.validation) == len(fitted.training) == 20
    error = rollout(fitted.system, FIRST, jnp.asarray(0.03), STEP, EACH, SNAPSHOTS)
    error = np.mean((error - held_back.coordinates[1:]) ** 2)
    best = min(fitted.validation) * np.mean(held_back.coordinates[1:] ** 2)
    assert error == pytest.approx(best, rel=1e-6)


def test_the_gradient_through_a_trajectory_is_that_of_central_differences():
    system = oscillator()

    def final(linear):
        moved = QuadraticSystem(system.constant, linear, system.quadratic)
        return jnp.sum(rollout(moved, FIRST, jnp.asarray(0.02), STEP, EACH, 10)[-1] ** 2)

    direction = jnp.asarray(np.random.default_rng(0).normal(size=system.linear.shape))
    along = jnp.vdot(jax.grad(final)(system.linear), direction)
    step = 1e-5
    ahead, behind = (final(system.linear + s * direction) for s in (step, -step))
    assert float(along) == pytest.approx(float((ahead - behind) / (2 * step)), rel=1e-7)


def test_what_cannot_be_learnt_from_is_refused():
    system, one = oscillator(), run(oscillator(), 0.01)
    with pytest.raises(ValueError, match="at least one run"):
        fit_linear_closure(system, [], STEP, EACH)
    with pytest.raises(ValueError, match="loss is not finite"):
        fit_linear_closure(
            oscillator(0.55), [one], STEP, EACH, window=20, iterations=40, learning_rate=1e200
        )
    with pytest.raises(ValueError, match="window: 100 intervals, but a run has 61"):
        fit_linear_closure(system, [one], STEP, EACH, window=100)
    short = ProjectedRun(0.01, one.coordinates[:, :2])
    with pytest.raises(ValueError, match="one has 2 modes, the system 3"):
        fit_linear_closure(system, [short], STEP, EACH)
