"""Points near points, on the host, whatever the box."""

import numpy as np
import pytest

from jaxsph import Box
from jaxsph.cloud import Cloud

BOXES = [
    Box((0.0, -1.0), (1.0, 1.0), (True, True)),
    Box((0.5, -1.0), (1.5, 1.0), (False, True)),
    Box((0.0, 0.0, 0.0), (1.0, 2.0, 1.5), (True, False, True)),
]


@pytest.mark.parametrize("box", BOXES, ids=lambda box: str(box.periodic))
def test_distances_are_those_of_the_nearest_images(box):
    rng, lengths = np.random.default_rng(0), np.asarray(box.lengths)
    periodic = np.asarray(box.periodic)
    inside = box.lower + rng.uniform(size=(60, box.dim)) * lengths
    outside = inside + np.where(periodic, lengths * rng.integers(-2, 3, inside.shape), 0.0)
    apart = inside[:, None] - inside
    apart -= np.where(periodic, lengths * np.round(apart / lengths), 0.0)
    distance = np.linalg.norm(apart, axis=-1)
    cloud, radius = Cloud(outside, box), 0.4
    np.testing.assert_array_equal(cloud.count_around(inside, radius), (distance < radius).sum(1))
    assert set(map(tuple, cloud.pairs(radius))) == {
        (i, j) for i, j in np.argwhere(distance < radius) if i < j
    }
    np.testing.assert_allclose(
        cloud.gaps(), np.where(np.eye(60, dtype=bool), np.inf, distance).min(1), rtol=1e-9
    )
    np.testing.assert_array_equal(cloud.nearest(inside)[1], np.arange(60))
    near = distance[:2] < radius
    np.testing.assert_array_equal(cloud.around(inside[:2], radius), np.flatnonzero(near.any(0)))


@pytest.mark.parametrize("start", [-1e-17, -1e-300, 1.0, np.float32(-1e-9)])
def test_a_point_at_the_face_to_round_off_is_inside(start):
    """The remainder of a tiny negative number is the length itself, which no tree takes."""
    cloud = Cloud(np.array([[start, 0.5], [0.01, 0.5]]), Box.unit_periodic(2))
    assert cloud.gaps() == pytest.approx([0.01, 0.01])
    assert list(cloud.around(np.array([[start, 0.5]]), 0.02)) == [0, 1]


def test_one_point_has_no_other():
    assert Cloud(np.zeros((1, 2)), BOXES[0]).gaps().tolist() == [np.inf]
    assert len(Cloud(np.zeros((1, 2)), BOXES[0]).around(np.zeros((0, 2)), 1.0)) == 0
