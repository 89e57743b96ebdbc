"""Quadratic systems by diffrax: against exact solutions, RK4 and central differences."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph_rom.points import QuadraticSystem, rollout
from jaxsph_rom.points.dynamics.adaptive import SolverError, solve

TIMES = jnp.linspace(0.1, 1.0, 10)
FIRST = jnp.asarray([1.0, 0.2, -0.1])
VISCOSITY = jnp.asarray(0.02)
SOLVERS = {"explicit": diffrax.Tsit5(), "implicit": diffrax.Kvaerno5()}
MAX_STEPS = 10_000


@eqx.filter_jit
def compiled(system, first, viscosity, solver, controller):
    return solve(
        system, first, viscosity, TIMES, solver=solver, controller=controller, max_steps=MAX_STEPS
    )


def solved(system, name, tolerance, first=FIRST, viscosity=VISCOSITY):
    tolerance = jnp.asarray(tolerance)
    controller = diffrax.PIDController(rtol=tolerance, atol=tolerance)
    return compiled(system, first, viscosity, SOLVERS[name], controller)


@pytest.fixture(autouse=True)
def usual_promotion():
    """diffrax's own code is traced once more where it is differentiated."""
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        yield


def oscillator(frequency=3.0):
    """An oscillation beside a decay, coupled by an energy-neutral quadratic term."""
    linear = np.zeros((2, 3, 3))
    linear[0, 1, 2], linear[0, 2, 1], linear[1] = frequency, -frequency, -20.0 * np.eye(3)
    carried = np.zeros((3, 3, 3))
    carried[0, 1, 1], carried[1, 0, 1] = 0.5, -0.5
    quadratic = 0.5 * (carried + carried.transpose(0, 2, 1))
    return QuadraticSystem(jnp.zeros((2, 3)), jnp.asarray(linear), jnp.asarray(quadratic))


def logistic(growth=1.0, saturation=1.0):
    """da/dt = g a - s a^2 for each of three: for g = s = 1, a = 1 / (1 + (1 / a0 - 1) exp(-t))."""
    linear = jnp.stack([growth * jnp.eye(3), jnp.zeros((3, 3))])
    quadratic = np.zeros((3, 3, 3))
    quadratic[range(3), range(3), range(3)] = -saturation
    return QuadraticSystem(jnp.zeros((2, 3)), linear, jnp.asarray(quadratic))


@pytest.mark.parametrize("name", SOLVERS)
def test_an_exact_solution(name):
    first = jnp.asarray([0.1, 0.5, 2.0])
    run = solved(logistic(), name, 1e-6, first).checked()
    exact = 1.0 / (1.0 + (1.0 / first - 1.0) * np.exp(-np.asarray(TIMES))[:, None])
    # steps are good to 1e-6; Kvaerno5 interpolates between them to third order only
    np.testing.assert_allclose(run.coordinates, exact, rtol=2e-5)
    assert 0 < int(run.steps) < 50 and 0 <= int(run.rejected) < int(run.steps)


def test_tolerances_are_kept_and_cost_steps():
    exact = rollout(oscillator(), FIRST, VISCOSITY, 1e-3, 100, 10)  # RK4, error 1e-13
    tolerances = (1e-3, 1e-6, 1e-9)
    runs = [solved(oscillator(), "explicit", tolerance).checked() for tolerance in tolerances]
    errors = [np.abs(run.coordinates - exact).max() for run in runs]
    assert all(e < 10 * t for e, t in zip(errors, tolerances, strict=True))
    assert errors[0] > 10 * errors[1] > 100 * errors[2]
    assert int(runs[0].steps) < int(runs[1].steps) < int(runs[2].steps)


def test_an_implicit_solver_steps_over_fast_decay():
    """A mode that is gone at once holds the explicit solver back for ever."""
    system = oscillator(1.0)
    system = eqx.tree_at(lambda s: s.linear, system, system.linear.at[0, 2, 2].set(-5e3))
    explicit, implicit = (int(solved(system, name, 1e-5).checked().steps) for name in SOLVERS)
    assert explicit > 5e3 / 3.5 > 10 * implicit  # the explicit stability limit is about 3.5


@pytest.mark.parametrize("name", SOLVERS)
def test_the_gradient_in_viscosity_is_that_of_central_differences(name):
    tolerance = jnp.asarray(1e-9)  # far below what the differences' step changes
    controller = diffrax.PIDController(rtol=tolerance, atol=tolerance)

    @jax.jit
    @jax.grad
    def slope(viscosity):
        run = solve(
            oscillator(), FIRST, viscosity, TIMES, solver=SOLVERS[name], controller=controller
        )
        return jnp.sum(run.coordinates[-1] ** 2)

    step = 1e-3
    ahead, behind = (
        jnp.sum(solved(oscillator(), name, 1e-9, viscosity=VISCOSITY + s).coordinates[-1] ** 2)
        for s in (step, -step)
    )
    # the differences' own error is (40 step)^2 / 6, from exp(-40 nu)
    assert float(slope(VISCOSITY)) == pytest.approx(float(ahead - behind) / (2 * step), rel=5e-4)


def test_runs_at_many_viscosities_are_each_as_if_alone():
    viscosities = jnp.asarray([0.0, 0.01, 0.1])

    @jax.jit
    @jax.vmap
    def many(viscosity):  # by the tolerance that is the default
        return solve(oscillator(), FIRST, viscosity, TIMES)

    together = many(viscosities).checked()
    controller = diffrax.PIDController(
        rtol=jnp.asarray(1e-6), atol=1e-6 * jnp.linalg.norm(FIRST)
    )
    for k, viscosity in enumerate(viscosities):
        alone = compiled(oscillator(), FIRST, viscosity, SOLVERS["explicit"], controller)
        np.testing.assert_allclose(together.coordinates[k], alone.coordinates, atol=1e-12)
        assert int(together.steps[k]) == int(alone.steps)


def test_failure_is_named():
    # da/dt = 6.5 a^2 from a = 1 is infinite at t = 0.154 s
    first = jnp.asarray([1.0, 0.1, 0.1])
    run = solved(logistic(0.0, -6.5), "explicit", 1e-6, first)
    assert not bool(run.good)
    with pytest.raises(SolverError, match=f"^the solver came to 1 of 10 times in {MAX_STEPS}"):
        run.checked()
    runs = jax.tree.map(
        lambda *a: jnp.stack(a), solved(logistic(), "explicit", 1e-6, first), run
    )
    assert runs.good.tolist() == [True, False]
    with pytest.raises(SolverError, match="run 1: the solver came to 1 of 10"):
        runs.checked()


def test_a_constant_step_that_meets_infinity_is_not_good():
    """It comes to the end, whatever it meets there."""
    controller = diffrax.ConstantStepSize()
    run = solve(
        logistic(0.0, -5.0), FIRST, VISCOSITY, TIMES, controller=controller, first_step=0.01,
        max_steps=200,
    )  # fmt: skip
    assert int(run.steps) == 100 and not bool(run.good)
