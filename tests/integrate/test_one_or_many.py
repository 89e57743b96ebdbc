"""What is done or not is the same alone, in a batch, and differentiated."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from jaxsph.integrate.one_or_many import moved_if, renewed_if

START = jnp.asarray([0.3, 0.8, 1.7])
GOING = jnp.asarray([True, False, True])
EITHER = pytest.mark.parametrize("done_if", [moved_if, renewed_if])


def three_steps(done_if, going, x):
    """Three steps of a small map, in a scan; a count goes along."""

    def step(carry, _):
        return done_if(going, lambda c: (jnp.sin(2.0 * c[0]), c[1] + 1), carry), None

    return lax.scan(step, (x, jnp.zeros((), jnp.int32)), None, length=3)[0]


@EITHER
def test_a_batch_is_its_members(done_if):
    moved = partial(three_steps, done_if)
    together = jax.vmap(moved)(GOING, START)
    for k in range(3):
        alone = moved(GOING[k], START[k])
        np.testing.assert_array_equal(alone[0], together[0][k])
        assert alone[1] == together[1][k] == (3 if GOING[k] else 0)
    twice = jax.vmap(jax.vmap(moved, (0, None)), (None, 0))(GOING, START)
    np.testing.assert_array_equal(jnp.diagonal(twice[0]), together[0])


@EITHER
@pytest.mark.parametrize("derivative", [jax.grad, jax.jacfwd])
def test_derivatives_are_those_of_each(derivative, done_if):
    moved = partial(three_steps, done_if)
    slope = derivative(lambda x, going: moved(going, x)[0])
    found = jax.jit(jax.vmap(slope))(START, GOING)
    of_sum = derivative(lambda x: jnp.sum(jax.vmap(moved)(GOING, x)[0]))(START)
    step = 1e-6
    ahead, behind = (jax.vmap(moved)(GOING, START + s)[0] for s in (step, -step))
    np.testing.assert_allclose(found, (ahead - behind) / (2.0 * step), atol=1e-8)
    np.testing.assert_allclose(of_sum, found, rtol=1e-12)
    assert found[1] == 1.0


def test_a_batch_renews_what_any_member_needs_and_else_nothing():
    made = []

    def renew(x):
        jax.debug.callback(lambda: made.append(1))
        return x + 1.0

    batch = jax.jit(jax.vmap(lambda outdated, x: renewed_if(outdated, renew, x)))
    np.testing.assert_array_equal(batch(~GOING & GOING, START), START)
    jax.effects_barrier()
    assert not made
    np.testing.assert_array_equal(batch(GOING, START), jnp.where(GOING, START + 1.0, START))
    jax.effects_barrier()
    assert made
