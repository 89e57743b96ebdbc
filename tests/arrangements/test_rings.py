"""Rings fill the disc that they are given, whatever its size in spacings."""

import numpy as np
import pytest

from jaxsph import Box, Space
from jaxsph.arrangements import Rings
from jaxsph.kernels import WendlandC2
from jaxsph.scenes import elliptic_drop, oscillating_drop


def space(resolution):
    dx = 2.0 / resolution
    return Space(Box((-2.0, -2.0), (2.0, 2.0), (False, False)), WendlandC2(), 2.0 * dx, dx)


@pytest.mark.parametrize(
    "resolution", [9, 10, 21, 24.7, 25, 25.3, 50, pytest.param(81, marks=pytest.mark.slow)]
)
def test_squares_of_the_particles_fill_the_disc(resolution):
    room = space(resolution)
    position = np.asarray(Rings(1.0).positions(room))
    distance = np.linalg.norm(position, axis=1)
    apart = np.linalg.norm(position[:, None] - position, axis=2) + 9.0 * np.eye(len(position))
    assert len(position) * room.cell_volume == pytest.approx(np.pi, rel=2.0 / resolution**1.5)
    assert 1.0 - 0.75 * room.spacing < distance.max() < 1.0 - 0.25 * room.spacing
    assert apart.min() > 0.6 * room.spacing


def test_without_a_radius_whole_rings_fill_the_box():
    position = np.asarray(Rings().positions(space(10)))
    assert len(position) == sum(round(2.0 * np.pi * (k + 0.5)) for k in range(10))


@pytest.mark.parametrize("make", [elliptic_drop, oscillating_drop])
@pytest.mark.parametrize("resolution", [20, 25])
def test_drops_hold_the_mass_of_their_disc(make, resolution):
    scene = make(resolution)
    mass = float(scene.mass) * len(scene.state.position)
    assert mass == pytest.approx(np.pi * float(scene.fluid.reference_density), rel=6e-3)


@pytest.mark.parametrize("radius", [0.0, -1.0, 2.1])
def test_a_radius_that_does_not_fit_is_refused(radius):
    with pytest.raises(ValueError, match="Rings: a radius of .* does not fit"):
        Rings(radius).positions(space(10))
