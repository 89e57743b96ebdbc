"""Scans with checkpoints, and gradients through the time loop."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from benchmarks import gradients
from jaxsph.integrate.checkpoints import checkpointed_scan, segment_length


def body(carry, x):
    return jnp.sin(carry) * x + 0.1 * carry


def plain(carry, xs):
    return lax.scan(lambda c, x: (body(c, x), None), carry, xs)[0]


@pytest.mark.parametrize("segment", [1, 3, 7, 10])
def test_a_scan_and_its_derivatives_are_those_without_checkpoints(segment):
    start, xs = jnp.asarray([0.3, 0.7]), jnp.linspace(0.9, 1.3, 7)

    def found(start, xs):
        return checkpointed_scan(body, start, xs, segment)

    np.testing.assert_array_equal(found(start, xs), plain(start, xs))
    for mode in (jax.jacrev, jax.jacfwd):
        wanted = mode(plain, argnums=(0, 1))(start, xs)
        for a, b in zip(mode(found, argnums=(0, 1))(start, xs), wanted, strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-13)  # sums of seven terms in another order
    both = jax.vmap(jax.grad(lambda s, x: found(s, x).sum()), (0, None))
    starts = jnp.stack([start, 2.0 * start])
    wanted = jax.vmap(jax.grad(lambda s, x: plain(s, x).sum()), (0, None))(starts, xs)
    np.testing.assert_allclose(both(starts, xs), wanted, rtol=1e-13)


def test_segments_keep_what_is_asked_for_and_grow_as_the_root():
    assert segment_length(100, 1, 100) == 1
    assert segment_length(100, 1, 1) == 100
    assert segment_length(2, 50, 10) == 2  # each interval keeps its own start
    for steps in (1, 2, 97, 100, 1000, 5003):
        segment = segment_length(steps, 1, None)
        kept, wanted = -(-steps // segment), 2.0 * np.sqrt(steps)
        assert kept <= np.ceil(wanted)
        assert segment <= np.ceil(wanted)  # at least half of the states are kept
        assert kept * segment - steps < segment
    with pytest.raises(ValueError, match="checkpoints: at least 1, got 0"):
        segment_length(100, 1, 0)


@pytest.mark.parametrize(
    "make",
    [
        gradients.periodic,
        pytest.param(gradients.walled, marks=pytest.mark.slow),  # tests/test_wall_sums.py has it
        gradients.reduced,
    ],
)
@pytest.mark.run_once
def test_gradients_through_the_loop_against_differences(make):
    """Through rebuilt lists, walls, the shift velocity's limiter, and a reduced model."""
    case = gradients.accuracy(make(12), 8)
    for row in case["rows"]:
        assert row["deviation"] < 1e-6, row
        # the two modes do the same arithmetic in another order
        assert row["forward_deviation"] < 1e-9, row


@pytest.mark.run_once
def test_memory_of_a_gradient_grows_as_the_root_of_the_steps():
    """Of the compiled programs, so that nothing has to run; kept whole it would be 16 times."""
    flow, base = gradients.periodic(12), jnp.asarray([1.0, 1.0, 0.0])

    def memory(steps):
        slope = jax.jit(jax.grad(lambda p: flow.final(p, steps)[0]))
        return slope.lower(base).compile().memory_analysis().temp_size_in_bytes

    assert memory(256) < 4.5 * memory(16)


@pytest.mark.run_once
def test_a_batch_of_gradients_is_each_of_them():
    flow = gradients.periodic(12)
    slope = jax.grad(lambda p: flow.final(p, 4)[0])
    points = jnp.asarray([[1.0, 1.0, 0.0], [0.8, 1.1, 0.02]])
    each = jnp.stack([jax.jit(slope)(p) for p in points])
    # round-off of sums over particles, in another order
    np.testing.assert_allclose(jax.jit(jax.vmap(slope))(points), each, rtol=1e-9)
