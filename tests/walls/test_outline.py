"""Regions within polygons, against shapely and exact distances."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import shapely

from jaxsph import BallRegion, Box, BoxRegion, Outline, Space, Walls
from jaxsph.kernels import WendlandC2


def star(points=5, radius=1.0, inner=0.4):
    angles = np.pi * np.arange(2 * points) / points
    radii = np.where(np.arange(2 * points) % 2, inner, radius)
    return np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)


def circle(count, center=(0.0, 0.0), radius=1.0):
    angles = 2.0 * np.pi * (np.arange(count) + 0.5) / count
    return np.asarray(center) + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


RINGS = {
    "a square, clockwise": [[(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)]],
    "an L": [[(0, 0), (1, 0), (1, 0.3), (0.3, 0.3), (0.3, 1), (0, 1), (0, 0)]],
    "a star": [star()],
    "a square with a round hole": [
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)],
        circle(40, radius=0.5),
    ],
    "two discs": [circle(30, (-0.6, 0.0), 0.3), circle(30, (0.6, 0.0), 0.3)],
}


@pytest.mark.parametrize("name", RINGS)
@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_distances_are_those_of_shapely(name, kind):
    rings = [np.asarray(ring, float) for ring in RINGS[name]]
    points = np.random.default_rng(0).uniform(-1.5, 1.5, (400, 2)).astype(kind)
    found = Outline(rings).signed_distance(jnp.asarray(points))
    assert found.dtype == kind
    lines = shapely.MultiLineString([np.concatenate([r, r[:1]]) for r in rings])
    inside = np.zeros(len(points), int)
    for ring in rings:
        inside += shapely.contains_xy(shapely.Polygon(ring), *points.T.astype(float))
    apart = shapely.distance(lines, shapely.points(points.astype(float)))
    expected = np.where(inside % 2 == 1, -apart, apart)
    np.testing.assert_allclose(found, expected, atol=1e-12 if kind == np.float64 else 3e-6)


def test_slopes_are_unit_and_nothing_is_lost_on_the_outline_itself():
    shape = Outline([star()])
    points = jnp.asarray(np.random.default_rng(1).uniform(-1.2, 1.2, (200, 2)))
    slope = jax.vmap(jax.grad(lambda x: shape.signed_distance(x[None, :])[0]))
    np.testing.assert_allclose(jnp.linalg.norm(slope(points), axis=1), 1.0, atol=1e-9)
    on_it = jnp.asarray([[1.0, 0.0], [0.5 * (1.0 + 0.4 * np.cos(np.pi / 5)),
                                     0.2 * np.sin(np.pi / 5)]])  # fmt: skip
    assert bool(jnp.isfinite(slope(on_it)).all())
    np.testing.assert_allclose(shape.signed_distance(on_it), 0.0, atol=1e-15)


def test_equal_outlines_are_one_and_say_where_they_are():
    one, other = Outline([star()]), Outline([np.concatenate([star(), star()[:1]])])
    assert one == other and hash(one) == hash(other)
    assert one.size[1][0] == pytest.approx(1.0)
    shape = shapely.Polygon(star()).difference(shapely.Point(0.0, 0.0).buffer(0.2))
    assert len(Outline.of_shapely(shape).rings) == 2
    assert len(Outline.of_shapely(shapely.MultiPolygon([shape])).rings) == 2


def test_walls_around_a_fine_polygon_are_those_of_the_disc():
    space = Space(Box((0.0, 0.0), (4.0, 4.0), (True, True)), WendlandC2(), 0.12, 0.08)
    everywhere = BoxRegion((-np.inf, -np.inf), (np.inf, np.inf))
    disc = Walls.around(everywhere & ~BallRegion((2.0, 2.0), 1.0), space)
    drawn = Walls.around(everywhere & ~Outline([circle(2000, (2.0, 2.0))]), space)
    np.testing.assert_array_equal(drawn.position, disc.position)
    np.testing.assert_allclose(drawn.normal, disc.normal, atol=2e-3)  # of a segment's half angle


@pytest.mark.parametrize(
    ("rings", "message"),
    [
        ([], "at least one"),
        ([[(0.0, 0.0), (1.0, 0.0), (1.0, 0.0), (0.0, 0.0)]], "three corners, got 2"),
        ([[(0.0, 0.0), (1.0, np.nan), (1.0, 1.0)]], "finite pairs"),
        ([[(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0)]], "finite pairs"),
        ([[(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)]], "cross near"),
        ([star(), star() + 0.3], "cross near"),
    ],
    ids=["none", "two corners", "not finite", "in space", "a bow", "two that overlap"],
)
def test_what_is_no_outline_is_refused(rings, message):
    with pytest.raises(ValueError, match=message):
        Outline(rings)


def test_points_in_space_are_refused():
    with pytest.raises(ValueError, match="of the plane, got points in 3 axes"):
        Outline([star()]).signed_distance(jnp.zeros((4, 3)))
