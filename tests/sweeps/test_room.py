"""A batch that a device has no room for is refused, with what would fit."""

import jax
import jax.numpy as jnp
import pytest

from jaxsph.sweeps.room import check_room

GIB = 2**30


class Device:
    """With so much memory, a quarter of it in use."""

    def __init__(self, limit):
        self.limit = limit

    def memory_stats(self):
        return {"bytes_limit": self.limit, "bytes_in_use": self.limit // 4}


@pytest.fixture(scope="module")
def program():
    """12 members of a quarter of a GiB each, in and out; nothing of it is allocated."""
    members = jax.ShapeDtypeStruct((12, GIB // 64), jnp.float64)
    return jax.jit(lambda a: 2.0 * a).lower(members).compile()


def test_a_batch_beyond_the_free_memory_is_refused_with_one_that_fits(program):
    check_room(program, Device(4 * GIB), 12)
    with pytest.raises(ValueError, match="batch: 12 .* 3.00 GiB .* 1.50 GiB are free; batch=6 sho"):
        check_room(program, Device(2 * GIB), 12)
    with pytest.raises(ValueError, match="make the scenes smaller"):
        check_room(program, Device(GIB // 8), 12)


def test_a_cpu_tells_nothing_and_is_let_pass(program):
    assert jax.devices("cpu")[0].memory_stats() is None
    check_room(program, jax.devices("cpu")[0], 12)
