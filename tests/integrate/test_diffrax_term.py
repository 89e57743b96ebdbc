"""Models of the loop in diffrax's solvers, and how far a neighbour list carries them."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array

from jaxsph.arrangements import Lattice
from jaxsph.integrate import FaultCode, Model, rk4_step
from jaxsph.integrate.diffrax_term import ode_term
from jaxsph.scenes import taylor_green


@pytest.fixture(autouse=True)
def usual_promotion():
    """diffrax counts on it."""
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        yield


class Forced(Model):
    """dx/dt = -k (x - cos t): it depends on time."""

    rate: Array

    def rates(self, time, state, auxiliary):
        return -self.rate * (state - jnp.cos(time))


def end(rate, start=0.5, adjoint=None):
    return end_of(Forced(jnp.asarray(rate)), start, adjoint)


def end_of(model, start, adjoint=None):
    state = jnp.asarray(start)
    found = diffrax.diffeqsolve(
        ode_term(model, model.prepare(state)), diffrax.Tsit5(), 0.0, 2.0, None, state,
        stepsize_controller=diffrax.PIDController(rtol=1e-10, atol=1e-10),
        adjoint=diffrax.RecursiveCheckpointAdjoint() if adjoint is None else adjoint,
    )  # fmt: skip
    return found.ys[-1]


def exact(k, start=0.5, t=2.0):
    """x = (k^2 cos t + k sin t) / (k^2 + 1) + what the start leaves."""
    steady = k / (k**2 + 1)
    return steady * (k * np.cos(t) + np.sin(t)) + (start - steady * k) * np.exp(-k * t)


def test_a_model_that_depends_on_time():
    assert float(jax.jit(end)(3.0)) == pytest.approx(exact(3.0), abs=1e-8)


def test_diffraxs_adjoints_differentiate_a_model():
    wanted = (exact(3.0 + 1e-5) - exact(3.0 - 1e-5)) / 2e-5
    model = Forced(jnp.asarray(3.0))  # the backsolve cannot close over what is traced
    for adjoint in (diffrax.RecursiveCheckpointAdjoint(), diffrax.BacksolveAdjoint()):

        def final(start, adjoint=adjoint):
            return end_of(model, start, adjoint)

        # in the start, for what a term closes over the backsolve does not see
        assert float(jax.jit(jax.grad(final))(0.5)) == pytest.approx(np.exp(-6.0), rel=1e-6)
    assert float(jax.jit(jax.grad(end))(3.0)) == pytest.approx(wanted, rel=1e-6)


def test_a_full_model_goes_as_far_as_its_list_lasts():
    scene = taylor_green(12, 100.0, arrangement=Lattice())
    model, start = scene.model(), scene.state
    neighbors = model.prepare(start)

    @eqx.filter_jit
    def both(model, start, neighbors, step):
        term, first = ode_term(model, neighbors), jnp.zeros(())
        found = diffrax.diffeqsolve(
            term, diffrax.Tsit5(), first, step, step, start,
            stepsize_controller=diffrax.ConstantStepSize(),
        )  # fmt: skip
        end = jax.tree.map(lambda a: a[-1], found.ys)
        loop = rk4_step(lambda t, y: model.rates(t, y, neighbors), first, start, step)
        return end, loop, model.inspect(1, end, neighbors).code

    end, loop, code = both(model, start, neighbors, jnp.asarray(1e-3))
    assert int(code) == int(FaultCode.NONE)
    # two methods of fourth and fifth order at a tenth of the stability limit
    np.testing.assert_allclose(end.velocity, loop.velocity, atol=1e-6)
    np.testing.assert_allclose(end.position, loop.position, atol=1e-8)
    _, _, code = both(model, start, neighbors, jnp.asarray(0.5))  # U dt is six spacings
    assert int(code) != int(FaultCode.NONE)
