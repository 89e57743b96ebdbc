"""What is drawn beyond the faces of a periodic box is what is at the other side."""

import numpy as np
import pytest

from jaxsph import Box
from jaxsph.io import read_box, read_snapshot
from jaxsph.plotting import snapshot_figure
from jaxsph.plotting.images import with_images
from jaxsph.report.film import film
from tests.report.test_film import told
from tests.runs import random_run

BOX = Box((1.0, 0.0), (3.0, 1.0), (True, False))


def test_images_are_those_of_the_other_side():
    position = np.array([[1.1, 0.5], [2.0, 0.1], [2.95, 0.9]])
    drawn, index = with_images(position, BOX, 0.2)
    np.testing.assert_array_equal(index, [0, 1, 2, 0, 2])
    np.testing.assert_allclose(drawn[3:], [[3.1, 0.5], [0.95, 0.9]])
    corner = with_images(np.array([[0.01, 0.99]]), Box.unit_periodic(2), 0.1)[0]
    wanted = {(0.01, 0.99), (1.01, 0.99), (0.01, -0.01), (1.01, -0.01)}
    assert {tuple(np.round(place, 6)) for place in corner} == wanted
    alone, index = with_images(position, None, 0.2)
    assert alone is position and len(index) == 3


@pytest.mark.parametrize("dim", [2, 3])
def test_a_picture_ends_at_the_faces(tmp_path, dim):
    path = random_run(tmp_path / "t.h5", count=2, dim=dim)
    assert read_box(path) == Box.unit_periodic(dim)
    time, snapshot = read_snapshot(path)
    figure = snapshot_figure(time, snapshot, box=read_box(path))
    axes = figure.axes[0]
    np.testing.assert_allclose([*axes.get_xlim(), *axes.get_ylim()], [0.0, 1.0, 0.0, 1.0])
    shown = axes.collections[0].get_offsets()
    assert len(shown) > 256 and (shown[:, 0] > 1.0).any() and (shown[:, 1] < 0.0).any()
    bare = snapshot_figure(time, snapshot).axes[0]
    assert len(bare.collections[0].get_offsets()) < len(shown)


def test_a_film_ends_there_too(tmp_path):
    found = told(film(random_run(tmp_path / "t.h5", count=2)))
    assert found["extent"] == [1.0, 1.0] and all(count > 256 for count in found["counts"])
