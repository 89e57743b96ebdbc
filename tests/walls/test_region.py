"""Regions: exact distances of boxes and balls, signs of what is composed of them, slopes."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxsph import BoxRegion, SignedDistance

BOXES = {
    "2d": BoxRegion((0.0, -1.0), (1.0, 0.5)),
    "3d": BoxRegion((0.0, -1.0, 2.0), (1.0, 0.5, 2.4)),
}
each_box = pytest.mark.parametrize("box", BOXES.values(), ids=BOXES.keys())
seeds = st.integers(0, 2**32 - 1)


@partial(jax.jit, static_argnums=0)
def slopes(region, points):
    """Gradient of the signed distance at each point."""
    return jax.vmap(jax.grad(lambda x: region.signed_distance(x[None, :])[0]))(points)


def around(box, count=2000, seed=0):
    """Points in a box and up to its own length beyond it."""
    lower, upper = np.asarray(box.lower), np.asarray(box.upper)
    unit = np.random.default_rng(seed).uniform(-1.0, 2.0, (count, len(lower)))
    return lower + unit * (upper - lower)


def landmarks(box):
    """Corners, edges, face centres, the centre, and such points one unit outside."""
    ticks = [
        (a - 1.0, a, 0.5 * (a + b), b, b + 1.0) for a, b in zip(box.lower, box.upper, strict=True)
    ]
    return np.stack(np.meshgrid(*ticks, indexing="ij"), -1).reshape(-1, len(box.lower))


# ------------------------------------------------------------------ boxes


def nearest_face_or_corner(box, points):
    """Signed distance in numpy: outside to the nearest point of the box, inside to a face."""
    lower, upper = np.asarray(box.lower), np.asarray(box.upper)
    outside = np.linalg.norm(points - np.clip(points, lower, upper), axis=1)
    inside = np.minimum(points - lower, upper - points).min(1)
    return np.where(outside > 0.0, outside, -inside)


@each_box
def test_distance_to_a_box_is_exact_inside_and_outside(box):
    points = np.concatenate([around(box), landmarks(box)])
    found = jax.jit(box.signed_distance)(jnp.asarray(points))
    exact = nearest_face_or_corner(box, points)
    assert (exact < 0.0).sum() > 20 and (exact > 0.0).sum() > 1000  # both kinds are there
    np.testing.assert_allclose(found, exact, atol=1e-15)  # round-off of lengths of order one


@pytest.mark.parametrize("free", [0, 1, 2])
def test_an_infinite_direction_does_not_count(free):
    finite = BOXES["3d"]
    lower = tuple(-np.inf if k == free else a for k, a in enumerate(finite.lower))
    upper = tuple(np.inf if k == free else b for k, b in enumerate(finite.upper))
    points = around(finite)
    kept = [k for k in range(3) if k != free]
    flat = BoxRegion(*(tuple(c[k] for k in kept) for c in (finite.lower, finite.upper)))
    found = BoxRegion(lower, upper).signed_distance(jnp.asarray(points))
    # the same arithmetic without the free direction's terms
    np.testing.assert_array_equal(found, flat.signed_distance(jnp.asarray(points[:, kept])))


def test_half_spaces_and_the_whole_space():
    points = jnp.asarray([[3.0, -2.0], [0.0, 0.25], [-1.0, 7.0]])
    half = BoxRegion((-np.inf, 1.0), (np.inf, np.inf))
    np.testing.assert_array_equal(half.signed_distance(points), [3.0, 0.75, -6.0])
    everything = BoxRegion((-np.inf,) * 2, (np.inf,) * 2)
    np.testing.assert_array_equal(everything.signed_distance(points), [-np.inf] * 3)


@each_box
def test_slope_of_a_box_is_finite_everywhere_and_a_unit_vector_away_from_it_outside(box):
    points = jnp.asarray(np.concatenate([around(box), landmarks(box)]))
    found = np.asarray(slopes(box, points))
    assert np.all(np.isfinite(found))  # on corners, edges, faces and in the centre as well
    lower, upper = np.asarray(box.lower), np.asarray(box.upper)
    away = np.asarray(points) - np.clip(points, lower, upper)
    distance = np.linalg.norm(away, axis=1, keepdims=True)
    outside = distance[:, 0] > 0.0
    # round-off of a division
    np.testing.assert_allclose(
        found[outside], (away / np.maximum(distance, 1e-9))[outside], atol=1e-14
    )
    assert np.all(np.linalg.norm(found, axis=1) <= 1.0 + 1e-14)


@each_box
def test_second_derivatives_of_a_box_are_finite(box):
    """A force that is made of the distance is differentiated once more in reverse mode."""
    points = jnp.asarray(landmarks(box))
    curvature = jax.jit(jax.grad(lambda x: jnp.sum(slopes(box, x))))(points)
    assert np.all(np.isfinite(curvature))


@pytest.mark.parametrize(
    "lower, upper",
    [
        ((0.0, 0.0), (1.0, 0.0)),
        ((0.0, 1.0), (1.0, 0.0)),
        ((0.0, float("nan")), (1.0, 1.0)),
        ((0.0,), (1.0, 1.0)),
        ((np.inf, 0.0), (np.inf, 1.0)),
    ],
)
def test_a_box_without_inside_is_refused(lower, upper):
    with pytest.raises(ValueError, match="BoxRegion: every upper must exceed its lower"):
        BoxRegion(lower, upper)


# ------------------------------------------------------------------ balls


@pytest.mark.parametrize("dim", [2, 3])
def test_a_ball_is_a_line_of_code(dim):
    ball = SignedDistance(lambda x: jnp.sqrt(jnp.sum(x * x, axis=1)) - 1.0)
    points = np.random.default_rng(0).normal(size=(200, dim))
    radius = np.linalg.norm(points, axis=1)
    # round-off of lengths of order one
    np.testing.assert_allclose(ball.signed_distance(jnp.asarray(points)), radius - 1.0, atol=1e-15)
    np.testing.assert_allclose(
        slopes(ball, jnp.asarray(points)), points / radius[:, None], atol=1e-15
    )


# ------------------------------------------------------------------ composition


def random_box(rng, dim):
    lower = rng.uniform(-1.0, 0.5, dim)
    upper = lower + rng.uniform(0.1, 1.0, dim)
    open_ended = rng.random(dim) < 0.2
    return BoxRegion(tuple(np.where(open_ended, -np.inf, lower).tolist()), tuple(upper.tolist()))


def random_region(rng, dim, depth=3):
    """A region with what numpy says of a point: is it inside?"""
    if depth == 0 or rng.random() < 0.2:
        box = random_box(rng, dim)
        return box, lambda x: np.all((x > box.lower) & (x < box.upper), axis=1)
    a, in_a = random_region(rng, dim, depth - 1)
    kind = rng.integers(0, 3)
    if kind == 0:
        return ~a, lambda x: ~in_a(x)
    b, in_b = random_region(rng, dim, depth - 1)
    if kind == 1:
        return a | b, lambda x: in_a(x) | in_b(x)
    return a & b, lambda x: in_a(x) & in_b(x)


@pytest.mark.parametrize("dim", [2, 3])
@settings(max_examples=30)
@given(seed=seeds)
def test_signs_follow_logic_and_sizes_never_exceed_the_distance(dim, seed):
    rng = np.random.default_rng(seed)
    region, inside = random_region(rng, dim)
    points = rng.uniform(-2.0, 2.0, (300, dim))
    found = np.asarray(region.signed_distance(jnp.asarray(points)))
    np.testing.assert_array_equal(found < 0.0, inside(points))  # none lies on a surface
    # A function that grows no faster than the way walked cannot exceed the distance to its zeros.
    there = rng.permutation(found.size)
    way = np.linalg.norm(points - points[there], axis=1)
    finite = np.isfinite(found)  # a region without a surface is infinitely far from it
    assert np.all(np.abs(found - found[there])[finite] <= way[finite] + 1e-12)  # round-off


def test_outside_a_union_and_inside_an_intersection_distances_are_exact():
    left, right = BoxRegion((-1.0, -1.0), (0.0, 1.0)), BoxRegion((-0.5, -1.0), (2.0, 1.0))
    points = around(BoxRegion((-1.0, -1.0), (2.0, 1.0)))
    both = np.stack([nearest_face_or_corner(b, points) for b in (left, right)])
    united = (left | right).signed_distance(jnp.asarray(points))
    common = (left & right).signed_distance(jnp.asarray(points))
    outside, inside = np.all(both > 0.0, axis=0), np.all(both < 0.0, axis=0)
    whole = nearest_face_or_corner(BoxRegion((-1.0, -1.0), (2.0, 1.0)), points)
    part = nearest_face_or_corner(BoxRegion((-0.5, -1.0), (0.0, 1.0)), points)
    assert outside.sum() > 100 and inside.sum() > 20
    np.testing.assert_allclose(united[outside], whole[outside], atol=1e-15)  # round-off
    np.testing.assert_allclose(common[inside], part[inside], atol=1e-15)


# ------------------------------------------------------------------ regions are structure


def shifted_disc(x):
    return jnp.sqrt(jnp.sum((x - 0.5) ** 2, axis=1)) - 0.2


def test_regions_are_equal_and_hash_alike_by_value():
    def make():
        hole = SignedDistance(shifted_disc)
        return (BoxRegion((0.0, 0.0), (1.0, 1.0)) | BoxRegion((0.0, 0.0), (2.0, 0.5))) & ~hole

    first, second = make(), make()
    assert first is not second and first == second and hash(first) == hash(second)
    assert len({first, second, ~first}) == 2
    assert BoxRegion((0.0, 0.0), (1.0, 1.0)) != BoxRegion((0.0, 0.0), (1.0, 1.1))


def test_an_equal_region_does_not_compile_again():
    traces = []

    @partial(jax.jit, static_argnums=0)
    def distance(region, points):
        traces.append(region)
        return region.signed_distance(points)

    for upper in (1.0, 1.0, 2.0):
        distance(BoxRegion((0.0, 0.0), (1.0, upper)), jnp.zeros((3, 2)))
    assert [region.upper[1] for region in traces] == [1.0, 2.0]


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_dtype_follows_the_points(dtype):
    everything = BoxRegion((-np.inf,) * 2, (np.inf,) * 2)
    box = BOXES["2d"]
    for region in (box, ~box, box | everything, box & ~everything, SignedDistance(shifted_disc)):
        points = jax.ShapeDtypeStruct((2, 2), dtype)
        assert jax.eval_shape(region.signed_distance, points).dtype == dtype
