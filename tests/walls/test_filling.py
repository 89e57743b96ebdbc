"""Volumes of regions, masses of particles in them, and rows at walls."""

import math

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import BallRegion, Box, BoxRegion, Fluid, ParticleState, Space, Walls, run_scene
from jaxsph.arrangements import JitteredLattice, Lattice
from jaxsph.effects import Gravity
from jaxsph.kernels import WendlandC2
from jaxsph.scenes import Scene, dam_break, piston_wave_maker, standing_wave
from jaxsph.schemes import Consistent, DeltaPlus
from jaxsph.walls.filling import volume

DX = 0.05


def make_space(box):
    return Space(box, WendlandC2(), 2.0 * DX, DX)


def closed(upper, lower=None):
    lower = (0.0,) * len(upper) if lower is None else lower
    return Box(lower, upper, (False,) * len(upper))


def scene(box, region=None, scheme=None, arrangement=None, gravity=None, keep=None, steps=10):
    """A fluid at rest that fills a region, or a part of it."""
    space = make_space(box)
    scheme, arrangement = scheme or DeltaPlus(), arrangement or Lattice()
    position = arrangement.positions(space)
    walls = None if region is None else Walls.around(region, space)
    force, pressure = None, jnp.zeros(len(position))
    if walls is not None:
        position = position[np.asarray(region.signed_distance(position)) < 0.0]
        pressure = jnp.zeros(len(position))
    if keep is not None:
        position = position[np.asarray(keep(position))]
        pressure = jnp.zeros(len(position))
    if gravity is not None:
        force = Gravity(jnp.zeros(box.dim).at[1].set(-gravity))
        pressure = 1000.0 * gravity * (box.upper[1] - position[:, 1])
    effects = scheme.effects(0.02, force, region)
    state = ParticleState(position, jnp.zeros_like(position), 1000.0 + pressure / 100.0)
    fluid = Fluid(1000.0, 10.0, 1.0)
    return Scene("still", effects, fluid, space, state, 0.01, 0.01 * steps, 10, walls=walls)


def mass(scene):
    """Of all the fluid, over rho0."""
    return float(scene.mass) * len(scene.state.position) / 1000.0


# ------------------------------------------------------------------ volumes


@pytest.mark.parametrize(
    "region, exact",
    [
        (BallRegion((0.5, 0.5), 0.41), math.pi * 0.41**2),
        (BallRegion((0.5, 0.5, 0.5), 0.41), 4.0 / 3.0 * math.pi * 0.41**3),
        (~BallRegion((0.5, 0.5), 0.2), 1.0 - math.pi * 0.2**2),
        (BoxRegion((0.115, 0.115), (0.815, 0.915)), 0.7 * 0.8),
    ],
    ids=["disc", "ball", "around-a-disc", "square"],
)
def test_a_volume_is_that_of_the_region(region, exact):
    dim = len(getattr(region, "center", (0, 0)))
    found = volume(region, make_space(closed((1.0,) * dim)))
    assert found == pytest.approx(exact, rel=1e-3)  # second order; 3e-5 to 4e-4 measured


def test_a_volume_between_cells_is_exact():
    inside = BoxRegion((0.1, 0.2), (0.8, 0.95)) & ~BoxRegion((0.3, 0.3), (0.5, 0.55))
    assert volume(inside, make_space(closed((1.0, 1.0)))) == pytest.approx(0.475, rel=1e-12)


# ------------------------------------------------------------------ masses


@pytest.mark.parametrize("rows", [8.48, 8.52, 8.0])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_vessel_that_is_no_whole_number_of_rows_deep_has_its_mass(rows, dim):
    upper = (0.4, rows * DX, 0.4)[:dim]
    still = scene(closed(upper), BoxRegion((0.0,) * dim, upper))
    assert mass(still) == pytest.approx(math.prod(upper), rel=1e-12)


@pytest.mark.parametrize("rows", [12.49, 12.5, 12.0])
def test_a_periodic_box_that_is_no_whole_number_of_spacings_has_its_mass(rows):
    box = Box((0.0, 0.0), (rows * DX,) * 2, (True, True))
    assert mass(scene(box)) == pytest.approx(box.volume, rel=1e-12)


def test_the_fluid_in_a_round_vessel_has_its_mass():
    pipe = BallRegion((0.5, 0.5), 8.0 * DX)
    still = scene(closed((1.0, 1.0)), pipe, arrangement=JitteredLattice(0.0))
    assert len(still.state.position) * DX**2 > 1.03 * math.pi * (8.0 * DX) ** 2
    assert mass(still) == pytest.approx(math.pi * (8.0 * DX) ** 2, rel=1e-3)


@pytest.mark.parametrize(
    "rows, scheme",
    [
        pytest.param(8.48, DeltaPlus(), id="8.48-delta-plus"),
        pytest.param(8.52, Consistent(), id="8.52-consistent"),
        pytest.param(8.52, DeltaPlus(), id="8.52-delta-plus", marks=pytest.mark.slow),
        pytest.param(8.48, Consistent(), id="8.48-consistent", marks=pytest.mark.slow),
    ],
)
def test_still_water_keeps_its_pressure_whatever_its_depth(rows, scheme):
    upper = (0.4, rows * DX)
    trajectory = run_scene(
        scene(closed(upper), BoxRegion((0.0, 0.0), upper), scheme, gravity=1.0, steps=200)
    )
    exact = 1000.0 * (upper[1] - trajectory.position[-1][:, 1])
    error = np.abs(trajectory.pressure[-1] - exact).max() / (1000.0 * upper[1])
    assert error < 0.02  # 0.01 and 0.003 measured; 0.3 to 0.8 with a mass of rho0 dx^2


# ------------------------------------------------------------------ scenes that fit


@pytest.mark.parametrize(
    "make, resolution, held",
    [
        (dam_break, 24, 2.0 * 0.05715**2),
        (dam_break, 49, 2.0 * 0.05715**2),
        (piston_wave_maker, 100, 0.3 * 3.3),
        (standing_wave, 31, 2.0),
    ],
)
def test_scenes_hold_the_water_they_speak_of_at_any_resolution(make, resolution, held):
    made = make(resolution, end_time=0.05)
    assert mass(made) == pytest.approx(held, rel=1e-12)
    assert made.parameters["resolution"] == resolution  # what was asked for makes it again
    ghosts = np.asarray(made.walls.position)
    for k, (step, lower) in enumerate(
        zip(made.space.steps, made.space.box.lower, strict=True)
    ):
        for points in (ghosts, np.asarray(made.state.position)):
            rows = (points[:, k] - lower) / step - 0.5
            np.testing.assert_allclose(rows, np.round(rows), atol=1e-6)


def test_ghosts_continue_the_lattice_where_the_spacing_does_not_divide_the_box():
    upper = (20.0 * DX, 12.45 * DX)  # 12 rows, and 8 of ghosts would be 20.75 spacings high
    space = make_space(closed(upper))
    walls = Walls.around(BoxRegion((0.0, 0.0), upper), space)
    rows = np.asarray(walls.position[:, 1]) / space.steps[1] - 0.5
    np.testing.assert_allclose(rows, np.round(rows), atol=1e-9)


# ------------------------------------------------------------------ refusals


def test_a_row_at_a_wall_is_refused():
    beside = BoxRegion((0.1, 0.1), (1.0755, 1.1))  # one face 0.01 spacings beyond a row
    with pytest.raises(ValueError, match="walls: .*nearer to a wall than 0.05 spacings"):
        scene(closed((1.2, 1.2)), beside)
    scene(closed((1.2, 1.2)), BoxRegion((0.1, 0.1), (1.1, 1.1)))


def test_a_vessel_that_is_half_full_wants_a_free_surface():
    upper = (0.8, 0.8)
    with pytest.raises(ValueError, match="particles: .* 50% of the room .* FreeSurface"):
        scene(closed(upper), BoxRegion((0.0, 0.0), upper), keep=lambda x: x[:, 1] < 0.4)
    with pytest.raises(ValueError, match="FreeSurface"):
        scene(Box((0.0, 0.0), upper, (True, True)), keep=lambda x: x[:, 0] < 0.4)
