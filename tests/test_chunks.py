"""Maps over rows a chunk at a time against maps of all rows, and their derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph.chunks import chunked_map, overlapping_map, wide_map


@pytest.mark.parametrize("rows", [0, 1, 5, 16, 100, 1337, 2000, 2001])
def test_maps_in_chunks_are_maps_of_all_rows(rows):
    values = jnp.arange(2.0 * rows).reshape(rows, 2)

    def function(block):
        one, other = block
        return jnp.sum(one, axis=1), other + 1

    whole = function((values, jnp.arange(rows)))
    for mapped in (chunked_map, overlapping_map, wide_map):
        for chunk in (1, 7, 8, 300, 5000):
            found = mapped(function, (values, jnp.arange(rows)), chunk)
            jax.tree.map(np.testing.assert_array_equal, found, whole)


def test_rows_beyond_the_last_have_a_derivative():
    def total(values):
        return jnp.sum(chunked_map(jnp.sqrt, values, 4))  # its derivative at zero is infinite

    values = jnp.arange(1.0, 8.0)  # seven rows in two chunks
    np.testing.assert_allclose(jax.grad(total)(values), 0.5 / np.sqrt(values))


def test_a_gpu_takes_all_rows_at_once_where_a_cpu_takes_a_few():
    mapped = jax.jit(lambda values: wide_map(jnp.sqrt, values, 5)).trace(jnp.arange(1.0, 21.0))
    taken = {
        platform: mapped.lower(lowering_platforms=(platform,)).as_text().count("tensor<4x5xf64>")
        for platform in ("cpu", "cuda")
    }
    assert taken["cpu"] > 0 and taken["cuda"] == 0
