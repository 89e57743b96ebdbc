"""The box: nearest images, wrapping, and boxes that are none."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from jaxsph import Box

BOXES = [
    Box((0.0, 0.0), (1.0, 1.0), (True, True)),
    Box((-0.3, 2.0), (0.4, 5.0), (True, False)),
    Box((-1.0, 0.5, -7.0), (1.0, 0.9, -3.0), (True, True, True)),
    Box((0.0, 0.0, -2.0), (0.4, 0.1, 2.0), (False, True, False)),
]
ROUND_OFF = 1e-12  # thousands of roundings of lengths and coordinates up to ten box lengths

each_box = pytest.mark.parametrize("box", BOXES, ids=lambda box: f"{box.periodic}")


def points(box, seed, count=8, stretch=5.0):
    """Up to `stretch` box lengths around the box."""
    unit = np.random.default_rng(seed).uniform(-stretch, stretch, (count, box.dim))
    return jnp.asarray(unit * np.asarray(box.lengths) + np.asarray(box.lower))


def all_images(box, reach):
    """Every shift of the box by whole periods, up to `reach` in each periodic direction."""
    shifts = [range(-reach, reach + 1) if p else (0,) for p in box.periodic]
    return np.asarray(list(itertools.product(*shifts))) * np.asarray(box.lengths)


@each_box
@given(seed=st.integers(0, 2**32 - 1))
def test_displacement_is_the_shortest_of_all_images(box, seed):
    start, end = points(box, seed, stretch=2.0), points(box, seed + 1, stretch=2.0)
    images = np.asarray(end - start)[:, None, :] + all_images(box, 5)[None]
    shortest = np.sqrt((images**2).sum(-1)).min(1)
    found = np.asarray(box.displacement(start, end))
    np.testing.assert_allclose(np.sqrt((found**2).sum(-1)), shortest, atol=ROUND_OFF)
    # and it leads from the start to an image of the end
    away = (np.asarray(start) + found - np.asarray(end)) / np.asarray(box.lengths)
    periodic = np.asarray(box.periodic)
    np.testing.assert_allclose(away[:, periodic], np.round(away[:, periodic]), atol=ROUND_OFF)
    np.testing.assert_allclose(away[:, ~periodic], 0.0, atol=ROUND_OFF)


@each_box
@given(seed=st.integers(0, 2**32 - 1))
def test_displacement_is_antisymmetric_to_the_last_bit(box, seed):
    # The symmetry of the neighbour list and of its transpose rests on it.
    start, end = points(box, seed), points(box, seed + 1)
    np.testing.assert_array_equal(box.displacement(start, end), -box.displacement(end, start))


@each_box
@given(seed=st.integers(0, 2**32 - 1))
def test_wrap_goes_into_the_box_by_whole_periods(box, seed):
    x = points(box, seed)
    wrapped = np.asarray(box.wrap(x))
    lower, upper = np.asarray(box.lower), np.asarray(box.upper)
    for k, periodic in enumerate(box.periodic):
        if periodic:
            assert np.all(wrapped[:, k] >= lower[k] - ROUND_OFF)
            assert np.all(wrapped[:, k] <= upper[k] + ROUND_OFF)
            periods = (wrapped[:, k] - np.asarray(x)[:, k]) / box.lengths[k]
            np.testing.assert_allclose(periods, np.round(periods), atol=ROUND_OFF)
        else:
            np.testing.assert_array_equal(wrapped[:, k], np.asarray(x)[:, k])
    np.testing.assert_allclose(box.wrap(box.wrap(x)), wrapped, atol=ROUND_OFF)


@each_box
@given(seed=st.integers(0, 2**32 - 1))
def test_wrapping_changes_no_displacement(box, seed):
    start, end = points(box, seed), points(box, seed + 1)
    found = box.displacement(box.wrap(start), box.wrap(end))
    np.testing.assert_allclose(found, box.displacement(start, end), atol=10.0 * ROUND_OFF)


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_a_point_just_below_the_lower_face_stays_finite_and_inside(dtype):
    box = Box.unit_periodic(2)
    tiny = jnp.asarray([[-1e-30, 0.5]], dtype)  # 1 - 1e-30 rounds to 1: the upper face itself
    wrapped = box.wrap(tiny)
    assert wrapped.dtype == dtype
    assert 0.0 <= wrapped[0, 0] <= 1.0


@each_box
def test_derivatives_of_displacement_and_wrap_are_the_identity(box):
    x, y = points(box, 0, count=1)[0], points(box, 1, count=1)[0]
    np.testing.assert_array_equal(jax.jacfwd(box.displacement, argnums=1)(x, y), jnp.eye(box.dim))
    np.testing.assert_array_equal(jax.jacrev(box.displacement)(x, y), -jnp.eye(box.dim))
    np.testing.assert_array_equal(jax.jacrev(box.wrap)(x), jnp.eye(box.dim))


def test_sizes():
    box = Box((-1.0, 0.5, -7.0), (1.0, 0.9, -3.0), (True, False, True))
    assert box.dim == 3
    np.testing.assert_allclose(box.lengths, (2.0, 0.4, 4.0), rtol=1e-15)  # one rounding
    assert box.volume == pytest.approx(3.2, rel=1e-14)  # product of rounded lengths
    assert Box.unit_periodic(3) == Box((0.0,) * 3, (1.0,) * 3, (True,) * 3)


def test_is_hashable_structure():
    box = Box((0.0, 0.0), (1.0, 2.0), (True, False))
    assert hash(box) == hash(Box((0.0, 0.0), (1.0, 2.0), (True, False)))
    assert box != Box((0.0, 0.0), (1.0, 2.0), (True, True))
    compiled = jax.jit(Box.wrap, static_argnums=0)
    np.testing.assert_allclose(compiled(box, jnp.asarray([[1.25, 3.0]])), [[0.25, 3.0]])


@pytest.mark.parametrize(
    "lower, upper, periodic",
    [
        ((0.0,), (1.0,), (True,)),  # one dimension
        ((0.0,) * 4, (1.0,) * 4, (True,) * 4),  # four
        ((0.0, 0.0), (1.0, 1.0, 1.0), (True, True)),  # corners of different dimension
        ((0.0, 0.0), (1.0, 1.0), (True,)),
        ((), (), ()),
    ],
)
def test_rejects_a_box_without_a_dimension_of_two_or_three(lower, upper, periodic):
    with pytest.raises(ValueError, match="lower, upper and periodic need 2 or 3 entries"):
        Box(lower, upper, periodic)


@pytest.mark.parametrize("upper", [0.0, -1.0, float("nan")])
def test_rejects_a_box_turned_inside_out(upper):
    with pytest.raises(ValueError, match="every upper must exceed its lower"):
        Box((0.0, 0.0), (1.0, upper), (True, True))
