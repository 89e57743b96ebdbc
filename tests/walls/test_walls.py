"""Ghosts: how many, where, facing which way, how fast; and geometries that are refused."""

import dataclasses
import math

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import BallRegion, Box, BoxRegion, MovingWall, SignedDistance, Space, Walls
from jaxsph.arrangements import JitteredLattice, Lattice
from jaxsph.kernels import QuinticSpline, WendlandC2
from jaxsph.scenes import couette, lid_driven_cavity
from jaxsph.walls.walls import fill, ghosts_in

SIDE = 20
DX = 1.0 / SIDE
SQUARE = BoxRegion((0.0, 0.0), (1.0, 1.0))
CHANNEL = BoxRegion((-np.inf, 0.0), (np.inf, 1.0))
ROUND_OFF = 1e-13


def space(dim=2, side=SIDE, periodic=False, kernel=None, h_over_dx=2.0):
    kernel = WendlandC2() if kernel is None else kernel
    periodic = (periodic,) * dim if isinstance(periodic, bool) else periodic
    return Space(Box((0.0,) * dim, (1.0,) * dim, periodic), kernel, h_over_dx / side, 1.0 / side)


def on_faces_and_corners(dim, side, layers):
    """Cells around a cube of side^dim cells whose centres are less than `layers` from it."""
    count = 0
    for directions in range(1, dim + 1):  # that point out of the cube: faces, edges, corners
        steps = np.arange(layers) + 0.5
        away = np.stack(np.meshgrid(*[steps] * directions), -1)
        within = int((np.sqrt((away**2).sum(-1)) < layers).sum())
        count += math.comb(dim, directions) * 2**directions * side ** (dim - directions) * within
    return count


# ------------------------------------------------------------------ number and place


@pytest.mark.parametrize(
    "dim, side, layers, expected",
    [
        # 4 faces of 20 x 4; of the 16 places at a corner 13 are within 4 dx of it
        (2, 20, None, 4 * 80 + 4 * 13),
        (2, 20, 3, 4 * 60 + 4 * 8),
        (3, 6, 2, on_faces_and_corners(3, 6, 2)),
    ],
    ids=["full support", "paper", "cube"],
)
def test_ghosts_continue_the_lattice_of_the_fluid(dim, side, layers, expected):
    here = space(dim, side)
    cube = BoxRegion((0.0,) * dim, (1.0,) * dim)
    walls = Walls.around(cube, here, layers=layers)
    assert walls.position.shape == walls.normal.shape == walls.velocity.shape == (expected, dim)
    steps = np.concatenate([walls.position, Lattice().positions(here)]) * side - 0.5
    np.testing.assert_allclose(steps, np.round(steps), atol=ROUND_OFF * side)
    assert len(np.unique(np.round(steps), axis=0)) == len(steps), "no place is taken twice"
    depth = np.asarray(cube.signed_distance(walls.position))
    layers = round(here.support * side) if layers is None else layers
    assert depth.min() == pytest.approx(0.5 / side, rel=1e-12)  # round-off
    assert (layers - 1) / side < depth.max() < layers / side
    np.testing.assert_array_equal(walls.velocity, jnp.zeros_like(walls.velocity))


def test_layers_fill_the_support_of_any_kernel():
    for kernel, h_over_dx, layers in ((WendlandC2(), 1.3, 3), (QuinticSpline(), 2.0, 6)):
        x = np.asarray(Walls.around(SQUARE, space(2, SIDE, False, kernel, h_over_dx)).position)
        above = x[np.abs(x[:, 0] - 0.5) < DX, 1] > 1.0  # in the two columns in the middle
        assert above.sum() == 2 * layers


def test_a_periodic_direction_has_no_wall():
    channel = BoxRegion((-np.inf, 0.0), (np.inf, 1.0))
    walls = Walls.around(channel, space(periodic=(True, False)))
    assert walls.position.shape == (2 * 4 * SIDE, 2)
    x = np.asarray(walls.position[:, 0])
    assert x.min() == pytest.approx(0.5 * DX) and x.max() == pytest.approx(1.0 - 0.5 * DX)


def test_a_channel_scene_has_the_particles_across_that_it_was_asked_for():
    side = 30
    scene = couette(side, h_over_dx=4.0, arrangement=Lattice())
    heights = np.unique(np.round(np.asarray(scene.state.position[:, 1]), 9))
    np.testing.assert_allclose(heights, (np.arange(side) + 0.5) / side, atol=1e-9)  # rounded above
    ghosts = np.asarray(scene.walls.position[:, 1])
    assert ghosts[ghosts < 0.0].max() == pytest.approx(-0.5 / side, rel=1e-9)
    # rho0 times the volume between the walls
    volume = scene.space.box.volume
    assert float(scene.mass) * len(scene.state.density) == pytest.approx(volume, rel=1e-12)


# ------------------------------------------------------------------ normals


@pytest.mark.parametrize("dim, side", [(2, SIDE), (3, 6)])
def test_normals_point_from_the_ghost_to_the_nearest_point_of_the_fluid(dim, side):
    walls = Walls.around(BoxRegion((0.0,) * dim, (1.0,) * dim), space(dim, side), layers=2)
    way = np.clip(walls.position, 0.0, 1.0) - np.asarray(walls.position)
    exact = way / np.linalg.norm(way, axis=1, keepdims=True)
    np.testing.assert_allclose(walls.normal, exact, atol=ROUND_OFF)
    corner = np.all(way != 0.0, axis=1)  # the normal of these is oblique
    assert corner.sum() == 2**dim * {2: 4 - 1, 3: 8 - 4}[dim]
    diagonal = np.abs(np.abs(way[corner]) - np.abs(way[corner])[:, :1]).max(1) < 1e-9
    np.testing.assert_allclose(
        np.abs(exact[corner][diagonal]), np.full((diagonal.sum(), dim), dim**-0.5), atol=1e-9
    )


def test_normals_around_an_edge_that_juts_into_the_fluid():
    """The open cavity: its floor and its side walls meet at right angles inside the fluid."""
    cavity = BoxRegion((-np.inf, 0.0), (np.inf, 0.1)) | BoxRegion((0.1, -0.1), (0.3, 0.1))
    dx = 0.4 / 64
    box = Box((0.0, -0.1), (0.4, 0.1), (True, False))
    walls = Walls.around(cavity, Space(box, WendlandC2(), 2.0 * dx, dx))
    position, normal = np.asarray(walls.position), np.asarray(walls.normal)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, atol=ROUND_OFF)
    left = (position[:, 0] < 0.1) & (position[:, 1] < 0.0) & (position[:, 1] > -0.05)
    deep, aside = -position[left][:, 1], 0.1 - position[left][:, 0]
    floor, side = deep < aside - 0.1 * dx, aside < deep - 0.1 * dx
    assert floor.sum() > 20 and side.sum() > 20
    np.testing.assert_allclose(normal[left][floor], [[0.0, 1.0]] * floor.sum(), atol=ROUND_OFF)
    np.testing.assert_allclose(normal[left][side], [[1.0, 0.0]] * side.sum(), atol=ROUND_OFF)


# ------------------------------------------------------------------ moving walls


@pytest.mark.parametrize("lid", ["regularised", "constant"])
def test_only_the_lid_moves_and_only_over_the_fluid(lid):
    walls = lid_driven_cavity(SIDE, lid=lid).walls
    x, y = np.asarray(walls.position).T
    over = (y > 1.0) & (x > 0.0) & (x < 1.0)
    assert over.sum() == 4 * SIDE
    profile = (1.0 - (2.0 * x - 1.0) ** 14) ** 2 if lid == "regularised" else np.ones_like(x)
    exact = np.stack([np.where(over, profile, 0.0), np.zeros_like(x)], axis=1)
    np.testing.assert_allclose(walls.velocity, exact, atol=ROUND_OFF)
    assert np.all(np.abs(np.sum(walls.velocity * walls.normal, axis=1))[over] < 1e-15)  # along it


def test_parts_move_each_with_its_own_velocity():
    def rising(x):
        return jnp.stack([jnp.zeros_like(x[:, 0]), 1.0 + x[:, 1] ** 2], axis=1)

    def falling(x):
        return jnp.stack([jnp.zeros_like(x[:, 0]), -x[:, 0]], axis=1)

    left, right = BoxRegion((-1.0, -1.0), (0.0, 2.0)), BoxRegion((1.0, -1.0), (2.0, 2.0))
    parts = (MovingWall(left, rising), MovingWall(right, falling))
    walls = Walls.around(SQUARE, space(), parts)
    x, y = np.asarray(walls.position).T
    # as fast as the place on the wall that is nearest, to a hair
    exact = np.where(x < 0.0, 1.0 + np.clip(y, 0.0, 1.0) ** 2, np.where(x > 1.0, -1.0, 0.0))
    exact = np.stack([np.zeros_like(exact), exact], axis=1)
    np.testing.assert_allclose(walls.velocity, exact, atol=1e-4)


# ------------------------------------------------------------------ round vessels


@pytest.mark.parametrize(
    "dim, side, area, margin",
    [
        # The lattice points in a disc or a shell scatter around its area: measured 0.6 and 3.3
        # percent in 2D, 2.5 and 0.001 in 3D.
        (2, 20, math.pi, 0.05),
        (3, 14, 4.0 * math.pi / 3.0, 0.05),
    ],
    ids=["disc", "ball"],
)
def test_round_vessels_from_their_signed_distance(dim, side, area, margin):
    vessel = SignedDistance(lambda x: jnp.sqrt(jnp.sum(x * x, axis=1)) - 1.0)
    dx = 2.0 / side
    here = Space(Box((-1.0,) * dim, (1.0,) * dim, (False,) * dim), WendlandC2(), 2.0 * dx, dx)
    walls = Walls.around(vessel, here, layers=3)
    fluid = np.asarray(fill(vessel, Lattice().positions(here)))

    radius = np.linalg.norm(walls.position, axis=1)
    assert radius.min() >= 1.0 and radius.max() < 1.0 + 3.0 * dx
    assert np.linalg.norm(fluid, axis=1).max() < 1.0
    outward = np.asarray(walls.position) / radius[:, None]
    np.testing.assert_allclose(walls.normal, -outward, atol=ROUND_OFF)
    assert len(fluid) * dx**dim == pytest.approx(area, rel=margin)
    shell = area * ((1.0 + 3.0 * dx) ** dim - 1.0)
    assert len(radius) * dx**dim == pytest.approx(shell, rel=margin)


def test_a_body_across_a_periodic_face_is_one_in_the_middle():
    halves = BallRegion((0.0, 0.5), 0.25) | BallRegion((1.0, 0.5), 0.25)
    across, amid = (
        Walls.around(CHANNEL & ~body, space(periodic=(True, False)))
        for body in (halves, BallRegion((0.5, 0.5), 0.25))
    )
    moved = np.array(across.position)
    moved[:, 0] = (moved[:, 0] + 0.5) % 1.0

    def ordered(points):
        return points[np.lexsort(np.round(points, 6).T)]

    np.testing.assert_allclose(ordered(moved), ordered(np.asarray(amid.position)), atol=1e-9)


def test_ghosts_on_a_walls_surface_slide_with_it():
    """Where a wall runs through places of the lattice, as one a half spacing lower does."""
    top = 1.0 - 0.5 * DX
    along = MovingWall(
        BoxRegion((-1.0, top), (2.0, 2.0)), lambda x: jnp.ones_like(x) * jnp.asarray([[1.0, 0.0]])
    )
    walls = Walls.around(BoxRegion((0.0, 0.0), (1.0, top)), space(), (along,))
    on_top = np.isclose(walls.position[:, 1], top)
    assert on_top.any()
    np.testing.assert_array_equal(walls.velocity[:, 0], walls.position[:, 1] > top - 0.1 * DX)


def test_a_ghost_between_two_parts_belongs_to_one_of_them():
    ghosts = np.stack([np.linspace(-1.0, 1.0, 5), np.full(5, -0.5)], axis=1)
    left, right = BoxRegion((-2.0, -1.0), (0.0, 0.0)), BoxRegion((0.0, -1.0), (2.0, 0.0))
    of_left, of_right = ghosts_in((left, right), ghosts, spacing=0.5)
    np.testing.assert_array_equal(of_left, [True, True, True, False, False])
    np.testing.assert_array_equal(of_right, ~of_left)
    whole = BoxRegion((-2.0, -1.0), (2.0, 0.0))  # that overlaps: each has what it covers
    for others in ((left, whole), (whole, left)):
        held = dict(zip(others, ghosts_in(others, ghosts, 0.5), strict=True))
        assert held[whole].all() and held[left].sum() == 3
    assert ghosts_in((), ghosts, 0.5) == []


# ------------------------------------------------------------------ what is refused


def between_solids(low, high):
    """The unit square between four solid slabs, the lower one cut by a slit."""
    floor = BoxRegion((-2.0, -1.0), (low, 0.0)) | BoxRegion((high, -1.0), (3.0, 0.0))
    ceiling = BoxRegion((-2.0, 1.0), (3.0, 2.0))
    sides = BoxRegion((-1.0, -1.0), (0.0, 2.0)) | BoxRegion((1.0, -1.0), (2.0, 2.0))
    return ~(floor | ceiling | sides)


def baffled(low, high):
    """The unit square with a vertical plate in it."""
    return SQUARE & ~BoxRegion((low, -1.0), (high, 0.5))


def lid(lower, upper):
    return MovingWall(BoxRegion(lower, upper), lambda x: jnp.ones_like(x))


REFUSED = {
    "fluid taller than its box": (
        r"walls: a gap at \(0\.?\d*, 1\) m: the fluid reaches past a closed face of its box",
        lambda: Walls.around(BoxRegion((0.0, 0.0), (1.0, 1.2)), space()),
    ),
    "a slit in the floor": (
        r"walls: a gap at \(0\.5\d*, 0\) m",
        lambda: Walls.around(between_solids(0.512, 0.512 + 0.36 * DX), space()),
    ),
    "a side left open": (
        r"walls: a gap at \(1, 0.5\) m",
        lambda: Walls.around(BoxRegion((0.0, 0.0), (np.inf, 1.0)), space()),
    ),
    "a plate thinner than a spacing": (
        r"walls: the wall at \(0\.(475|5\d*), 0\.\d*\) m is about 0\.0\d+ m thick, thinner than "
        r"twice the kernel's support of 0\.2 m.*resolution",
        lambda: Walls.around(baffled(0.475, 0.525), space()),
    ),
    "a plate thinner than the support": (
        "thinner than twice the kernel's support of 0.2 m",
        lambda: Walls.around(baffled(0.4, 0.5), space()),
    ),
    "a plate thinner than twice the support": (
        "thinner than twice the kernel's support of 0.2 m",
        lambda: Walls.around(baffled(0.35, 0.7), space()),
    ),
    "a wall thin across a periodic face": (
        "thinner than twice the kernel's support",
        lambda: Walls.around(
            BoxRegion((0.1, -np.inf), (0.9, np.inf)), space(periodic=(True, True))
        ),
    ),
    "half a body at a periodic face": (
        r"walls: torn at a periodic face of the box: \(0, 0\.\d+\) m and \(1, 0\.\d+\) m are one",
        lambda: Walls.around(
            CHANNEL & ~BallRegion((0.0, 0.5), 0.25), space(periodic=(True, False))
        ),
    ),
    "no wall at all": (
        "walls: the region of fluid leaves no place for a wall",
        lambda: Walls.around(BoxRegion((-np.inf,) * 2, (np.inf,) * 2), space(periodic=True)),
    ),
    "a distance without slope": (
        "walls: the signed distance has no slope at",
        lambda: Walls.around(
            SignedDistance(lambda x: 0.1 * SQUARE.signed_distance(x)), space(), layers=2
        ),
    ),
    "a lid in mid-fluid": (
        "moving wall: no ghost lies in BoxRegion.*a lid needs a wall to sit in",
        lambda: Walls.around(SQUARE, space(), (lid((0.2, 0.2), (0.8, 0.8)),)),
    ),
    "a lid beyond the walls": (
        "moving wall: no ghost lies in BoxRegion",
        lambda: Walls.around(SQUARE, space(), (lid((0.0, 1.0 + 5 * DX), (1.0, 2.0)),)),
    ),
    "no layer": (
        "layers: at least 1 layer of ghosts, got 0",
        lambda: Walls.around(SQUARE, space(), layers=0),
    ),
    "no fluid": (
        "fluid: no particle lies in the region",
        lambda: fill(BoxRegion((2.0, 2.0), (3.0, 3.0)), Lattice().positions(space())),
    ),
}


@pytest.mark.parametrize("message, make", REFUSED.values(), ids=REFUSED.keys())
def test_geometries_that_do_not_hold_are_refused_in_one_line(message, make):
    with pytest.raises(ValueError, match=message) as refusal:
        make()
    assert "\n" not in str(refusal.value)


def test_what_is_just_thick_or_tight_enough_is_not_refused():
    Walls.around(between_solids(0.52, 0.51), space())  # solids that overlap leave no slit
    plate = Walls.around(baffled(0.3, 0.7), space()).position  # twice the support
    assert np.any((plate[:, 0] > 0.3) & (plate[:, 0] < 0.7) & (plate[:, 1] > 0.25))


def test_a_particle_that_starts_in_a_wall_is_refused_by_number():
    scene = lid_driven_cavity(SIDE)
    moved = scene.state.position.at[5].set(jnp.asarray([1.01, 0.5]))
    state = dataclasses.replace(scene.state, position=moved)
    with pytest.raises(ValueError, match=r"particles: number 5 at .* start inside a wall") as error:
        dataclasses.replace(scene, state=state)
    assert "\n" not in str(error.value)
    on_the_surface = scene.state.position.at[5].set(jnp.asarray([1.0, 0.5]))
    dataclasses.replace(scene, state=dataclasses.replace(state, position=on_the_surface))


def test_beyond_says_which_particles_are_in_a_wall():
    walls = Walls.around(SQUARE, space())
    where = jnp.asarray([[0.5, 0.5], [1.0, 0.5], [1.0 + 1e-9, 0.5], [-0.1, -0.1], [0.0, 0.0]])
    np.testing.assert_array_equal(walls.beyond(where), [False, False, True, True, False])


def test_jitter_below_half_a_spacing_keeps_every_particle_in_the_fluid():
    x = JitteredLattice(0.49).positions(space())
    assert len(fill(SQUARE, x)) == SIDE**2
