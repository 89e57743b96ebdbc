"""Ghosts in rows along curved walls."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import Box, Space, Walls
from jaxsph.kernels import WendlandC2
from jaxsph.scenes import channel_cylinder, cylinder
from jaxsph.scenes.record import scene_from_record
from jaxsph.walls import BallRegion, BoxRegion, WallPart

DX = 0.1


def space(dim=2, height=3.0):
    box = Box((0.0,) * dim, (4.0, *(height,) * (dim - 1)), (True, *(False,) * (dim - 1)))
    return Space(box, WendlandC2(), 1.5 * DX, DX)


CHANNEL = BoxRegion((-np.inf, 0.0), (np.inf, 3.0))


def of_body(center, rows=True):
    """Ghosts of a disc in a channel, about its centre."""
    body = BallRegion(center, 0.47)
    walls = Walls.around(CHANNEL & ~body, space(), in_rows=[body] if rows else ())
    ghosts = np.asarray(walls.position) - np.asarray(center)
    held = np.linalg.norm(ghosts, axis=1) < 0.47
    return ghosts[held], np.asarray(walls.normal)[held], np.asarray(walls.position)[~held]


def test_rows_are_half_a_spacing_apart_from_the_wall_and_whole_spacings_from_each_other():
    ghosts, normal, others = of_body((2.0, 1.5))
    radius = np.linalg.norm(ghosts, axis=1)
    depth = (0.47 - radius) / DX
    np.testing.assert_allclose(depth % 1.0, 0.5, atol=1e-4)
    np.testing.assert_allclose(normal, ghosts / radius[:, None], atol=1e-5)
    for k in range(3):
        row = ghosts[np.round(depth - 0.5) == k]
        assert len(row) == round(2.0 * np.pi * (0.47 - (k + 0.5) * DX) / DX)
        turns = np.sort(np.arctan2(row[:, 1], row[:, 0]))
        np.testing.assert_allclose(np.diff(turns), 2.0 * np.pi / len(row), rtol=1e-3)
        near = np.abs(turns[:, None] + turns[None, :])  # in y mirrored, as the body is
        np.testing.assert_allclose(np.minimum(near, 2.0 * np.pi - near).min(axis=1), 0.0, atol=1e-4)
    plates = np.asarray(Walls.around(CHANNEL, space()).position)
    np.testing.assert_array_equal(others, plates)  # stay on the lattice


def test_a_body_has_as_many_wherever_it_is_on_the_lattice():
    places = [(2.0 + a * DX, 1.5 + b * DX) for a, b in ((0.0, 0.0), (0.1, 0.0), (0.3, 0.7))]
    assert len({len(of_body(place)[0]) for place in places}) == 1
    assert len({len(of_body(place, rows=False)[0]) for place in places}) > 1


def test_a_wall_s_kernel_sum_is_even_along_rows_and_not_along_stairs():
    """Half a spacing off the surface, wherever the body is."""
    kernel, h = WendlandC2(), 1.5 * DX
    turns = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
    beside = (0.47 + 0.5 * DX) * np.stack([np.cos(turns), np.sin(turns)], axis=1)

    def spread(rows):
        found = []
        for place in [(2.0, 1.5), (2.03, 1.52), (2.07, 1.54)]:
            ghosts, *_ = of_body(place, rows)
            apart = np.linalg.norm(beside[:, None] - ghosts[None], axis=2)
            found.append(DX**2 * np.asarray(kernel.value(jnp.asarray(apart), h, 2)).sum(axis=1))
        return np.std(found) / np.mean(found)

    assert spread(rows=True) < 0.04
    assert spread(rows=False) > 4.0 * spread(rows=True)


def test_a_body_across_a_periodic_face_is_one_body():
    halves = BallRegion((0.0, 1.5), 0.47) | BallRegion((4.0, 1.5), 0.47)
    ghosts = np.asarray(Walls.around(CHANNEL & ~halves, space(), in_rows=[halves]).position)
    ghosts = (ghosts - [2.0, 1.5]) % [4.0, 10.0] - [2.0, 0.0]  # about it
    ghosts[:, 1] = (ghosts[:, 1] + 5.0) % 10.0 - 5.0
    own = ghosts[np.linalg.norm(ghosts, axis=1) < 0.47]
    assert abs(len(own) - len(of_body((2.0, 1.5))[0])) <= 3  # rows are rounded in two parts
    nearest = np.sort(np.linalg.norm(own[:, None] - own[None], axis=2), axis=1)[:, 1]
    assert nearest.min() > 0.7 * DX


def test_rows_along_a_flat_wall_are_those_of_the_lattice():
    plate = BoxRegion((-np.inf, -np.inf), (np.inf, 0.0))
    on, along = (
        np.asarray(Walls.around(CHANNEL, space(), in_rows=parts).position)
        for parts in ((), (plate,))
    )
    on, along = (ghosts[np.lexsort(np.round(ghosts / DX, 3).T)] for ghosts in (on, along))
    np.testing.assert_allclose(along, on, atol=1e-5 * DX)


def test_rows_around_the_outside_of_a_vessel_hold_its_area():
    disc = BallRegion((2.0, 1.5), 1.1)
    box = Box((0.5, 0.0), (3.5, 3.0), (False, False))
    place = Space(box, WendlandC2(), 1.5 * DX, DX)
    walls = Walls.around(disc, place, in_rows=[~disc], parts=[WallPart("vessel", ~disc)])
    radius = np.linalg.norm(np.asarray(walls.position) - [2.0, 1.5], axis=1)
    assert radius.min() == pytest.approx(1.15, abs=1e-4)
    ring = np.pi * ((1.1 + 3 * DX) ** 2 - 1.1**2)
    assert len(radius) * place.cell_volume == pytest.approx(ring, rel=5e-3)


def test_what_has_no_rows_is_refused():
    ball = BallRegion((2.0, 1.5, 1.5), 0.5)
    tall = BoxRegion((-np.inf, 0.0, 0.0), (np.inf, 3.0, 3.0))
    with pytest.raises(ValueError, match="in two dimensions; leave it out in three"):
        Walls.around(tall & ~ball, space(3), in_rows=[ball])
    with pytest.raises(ValueError, match="in_rows: no fixed wall lies in"):
        Walls.around(CHANNEL, space(), in_rows=[BallRegion((2.0, 1.5), 0.5)])
    with pytest.raises(ValueError, match="ghosts: one of rows, lattice, got 'stairs'"):
        channel_cylinder(33, ghosts="stairs")


def test_scenes_of_a_cylinder_take_either():
    for make, size in ((channel_cylinder, 33), (cylinder, 8)):
        rows, lattice = (make(size, ghosts=kind, end_time=0.1) for kind in ("rows", "lattice"))
        assert rows.parameters["ghosts"] == "rows"
        assert not np.array_equal(rows.walls.position, lattice.walls.position)
        before = {k: v for k, v in lattice.parameters.items() if k != "ghosts"}
        again = scene_from_record(lattice.name, before)  # of a file from before there was a choice
        np.testing.assert_array_equal(again.walls.position, lattice.walls.position)
