"""Bodies that the fluid moves in three dimensions: momentum, axes, buoyancy, files, refusals."""

import dataclasses

import equinox as eqx
import h5py
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from jaxsph import (
    BallRegion,
    Box,
    BoxRegion,
    Fluid,
    FreeBody,
    ParticleState,
    SignedDistance,
    Space,
    Trajectory,
    WallForces,
    WallPart,
    Walls,
    run_scene,
)
from jaxsph.arrangements import JitteredLattice, Lattice
from jaxsph.body_state import BodyState
from jaxsph.cli import main
from jaxsph.effects import (
    Continuity,
    DensityDiffusion,
    Gravity,
    LaminarViscosity,
    NoSlip,
    PressureForce,
    WallPressure,
    WallRepulsion,
)
from jaxsph.integrate import integrate
from jaxsph.io import BodyShapes, read_trajectory, read_walls_of
from jaxsph.kernels import WendlandC2
from jaxsph.plotting.particles import middle_layer
from jaxsph.report.film import film
from jaxsph.scenes import Scene
from jaxsph.walls.walls import fill

SIDE, DX, DT = 1.4, 0.1, 2e-3
START = jnp.zeros(())
FLUID = Fluid(1000.0, 10.0, 1.0)
TANK = BoxRegion((0.0,) * 3, (SIDE,) * 3)
SPACE = Space(Box((0.0,) * 3, (SIDE,) * 3, (False,) * 3), WendlandC2(), 1.3 * DX, DX)
HALVES = np.array([0.3, 0.33, 0.36])  # of a brick: three moments of inertia
CENTER, SPIN = np.array([0.7, 0.69, 0.72]), np.array([0.5, -0.3, 0.8])
DOWN = np.array([0.0, 0.0, -1.0])
NEXT = [2, 0, 1]  # the axis that comes to the place of each when all are turned on by one


def brick(order=(0, 1, 2)):
    low, high = (CENTER - HALVES)[list(order)], (CENTER + HALVES)[list(order)]
    return BoxRegion(tuple(low), tuple(high))


def scene(order=(0, 1, 2), density=700.0, stirred=0.3, spin=SPIN):
    """A jittered, stirred, unevenly compressed fluid around a brick that turns, all in axes of an
    order: what conserves momentum in the fluid."""
    order, region = list(order), brick(order)
    body = FreeBody.of_density(region, density, SPACE, spin=spin[order])
    walls = Walls.around(TANK, SPACE, parts=(WallPart("brick", region),), free_bodies=(body,))
    rng, lattice = np.random.default_rng(3), Lattice().positions(SPACE)
    own = SignedDistance(lambda x: jnp.maximum(
        TANK.signed_distance(x), -brick().signed_distance(x)
    ))  # fmt: skip
    even, x = fill(own, lattice), fill(own, lattice, JitteredLattice(0.2, 1).positions(SPACE))
    x = jnp.where(own.signed_distance(x)[:, None] > -0.2 * DX, even, x)[:, np.asarray(order)]
    gravity = 9.81 * DOWN[order]
    effects = (
        Continuity(),
        PressureForce(),
        LaminarViscosity(jnp.asarray(0.01)),
        DensityDiffusion(jnp.asarray(0.1)),
        Gravity(jnp.asarray(gravity)),
        WallPressure(),
        NoSlip(),
        WallRepulsion(TANK),
    )
    velocity = (stirred * rng.normal(size=x.shape))[:, order]
    rho = 1000.0 * (1.0 + 0.01 * stirred * rng.normal(size=len(x)))
    state = ParticleState(x, jnp.asarray(velocity), jnp.asarray(rho))
    return Scene("brick", effects, FLUID, SPACE, state, DT, 10 * DT, 2, {}, walls)


@pytest.fixture(scope="module")
def tank():
    return scene()


@pytest.fixture(scope="module")
def model(tank):
    return tank.model(margin=2.0)


def test_mass_centre_and_moments_of_inertia_are_those_of_the_region():
    box = FreeBody.of_density(BoxRegion((0.3, 0.4, 0.5), (1.1, 1.0, 1.2)), 500.0, SPACE)
    a, b, c = 0.8, 0.6, 0.7
    assert float(box.mass) == pytest.approx(500.0 * a * b * c, rel=1e-12)  # faces between cells
    np.testing.assert_allclose(box.center, [0.7, 0.7, 0.85], atol=1e-12)
    expected = float(box.mass) / 12.0 * np.diag([b * b + c * c, c * c + a * a, a * a + b * b])
    np.testing.assert_allclose(box.inertia, expected, atol=1e-12 * expected.max())
    ball = FreeBody.of_density(BallRegion((0.73, 0.68, 0.7), 0.5), 1.0, SPACE)
    # second order in a part of dx / 4
    assert float(ball.mass) == pytest.approx(4.0 / 3.0 * np.pi * 0.5**3, rel=2e-3)
    np.testing.assert_allclose(ball.center, [0.73, 0.68, 0.7], atol=2e-4)
    inertia = 0.4 * float(ball.mass) * 0.5**2
    np.testing.assert_allclose(ball.inertia, inertia * np.eye(3), atol=4e-3 * inertia)
    assert ball.spin.shape == (3,) and ball.velocity.shape == (3,)


@pytest.mark.run_once
def test_the_body_gets_what_the_fluid_gives(tank, model):
    """Force on all walls, weight and rate of momentum; the body's own rates are those of the force
    on its part of the walls, and by Euler's equations of the torque."""
    turn, spin = jnp.asarray([[0.05, -0.04, 0.06]]), tank.state.bodies.spin
    state = eqx.tree_at(lambda s: s.bodies.angle, tank.state, turn)  # not in the body's own axes
    forces, torques = WallForces.of(tank)(model, START, state)
    rates = eqx.filter_jit(model.rates)(START, state, model.prepare(state))
    body, largest = tank.walls.free.parts[0], np.abs(forces["walls"]).max()
    fluid = tank.mass * np.asarray(rates.velocity).sum(axis=0)
    own = float(body.mass) * np.asarray(rates.bodies.velocity[0])
    total = 9.81 * DOWN * (float(tank.mass) * len(state.position) + float(body.mass))
    fixed = np.asarray(forces["walls"] - forces["brick"])
    np.testing.assert_allclose(fluid + own + fixed, total, atol=1e-10 * largest)
    assert np.abs(own - 9.81 * DOWN * float(body.mass)).max() > 0.01 * largest
    lever = torques["brick"] - np.cross(np.asarray(state.bodies.position[0]), forces["brick"])
    axes = Rotation.from_rotvec(np.array(turn[0])).as_matrix()
    inertia, w = axes @ np.asarray(body.inertia) @ axes.T, np.asarray(spin[0])
    euler = inertia @ np.asarray(rates.bodies.spin[0]) + np.cross(w, inertia @ w)
    np.testing.assert_allclose(euler, lever, atol=1e-10 * largest)
    assert np.abs(np.cross(w, inertia @ w)).max() > 1e6 * 1e-10 * np.abs(lever).max()
    np.testing.assert_array_equal(rates.bodies.position, state.bodies.velocity)


@pytest.fixture(scope="module")
def kept(tank, tmp_path_factory):
    """A run of ten steps in a file."""
    path = tmp_path_factory.mktemp("space") / "brick.h5"
    return path, run_scene(tank, path, measure=None, averaged=None)


@pytest.mark.run_once
def test_axes_turned_on_by_one_turn_the_rates(tank):
    """(x, y, z) -> (z, x, y), a turn by a third about the diagonal: fluid, body and weight."""
    turn, found = np.array([0.3, -0.2, 0.4]), []
    for flow, order in ((tank, [0, 1, 2]), (scene(NEXT), NEXT)):
        angle = jnp.asarray(turn[order])[None]
        state = eqx.tree_at(lambda s: s.bodies.angle, flow.state, angle)
        model = flow.model(margin=2.0)
        found.append(eqx.filter_jit(model.rates)(START, state, model.prepare(state)))
    here, there = found
    for name in ("position", "velocity", "angle", "spin"):
        one = getattr(here.bodies, name)[0]
        np.testing.assert_allclose(
            getattr(there.bodies, name)[0], one[jnp.asarray(NEXT)], atol=1e-11 * jnp.abs(one).max()
        )
    largest = float(jnp.abs(here.velocity).max())
    np.testing.assert_allclose(
        there.velocity, here.velocity[:, np.asarray(NEXT)], atol=1e-11 * largest
    )
    assert np.abs(here.bodies.spin).min() > 1.0, "a torque that is there"


@pytest.mark.run_once
def test_files_and_pictures_have_the_body(kept, tank, capsys):
    path, run = kept
    back = read_trajectory(path)
    assert run.bodies.angle.shape == (6, 1, 3)
    np.testing.assert_array_equal(back.bodies.angle, run.bodies.angle)
    with h5py.File(path) as file:
        assert file["bodies/spin"].attrs["unit"] == "rad/s"
    last = run.snapshot(-1)
    own = np.asarray(tank.walls.free.owner) == 0
    expected = np.asarray(tank.walls.at(START, last.bodies).position)[own]
    np.testing.assert_allclose(read_walls_of(path, last)[-own.sum() :], expected, atol=1e-6)
    assert main(["show", str(path)]) == 0
    told = capsys.readouterr().out
    x, y, z = run.bodies.position[-1, 0]
    assert f"at ({x:.5g}, {y:.5g}, {z:.5g}) m, turned by" in told and "degrees about (" in told
    places = expected[middle_layer(last.position, expected), :2]
    assert 0 < len(places) < len(expected), "those in the layer that is drawn"
    assert f"{middle_layer(last.position).sum() + len(places)}]" in film(path)
    picture = run.animate(path.with_name("brick.gif"), shapes=BodyShapes.of(tank.walls))
    with Image.open(picture) as drawn:
        assert drawn.n_frames == 6


def test_a_body_is_drawn_once_it_comes_into_the_layer_that_is_drawn(tmp_path):
    """A small one that rises into it; the picture's frame is the particles'."""
    x = np.stack(np.meshgrid(*[np.arange(10.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    x = x[np.hypot(*(x[:, :2] - 4.5).T) > 1.5]  # room for it
    steps, still = 3, np.zeros((3, 1, 3))
    height = np.array([1.0, 2.5, 4.5])
    center = np.stack([np.full(3, 4.5), np.full(3, 4.5), height], axis=1)[:, None]
    body, each = BodyState(center, still, still, still), np.ones((steps, len(x)))
    run = Trajectory(np.arange(3.0), np.stack([x] * 3), 0.0 * np.stack([x] * 3), each, each,
                     bodies=body)  # fmt: skip
    arm = np.array([[0.0, 0.0, 0.0], [0.4, 0.0, 0.0], [0.0, 0.4, 0.0]])
    frames = []
    for shapes in (None, BodyShapes(arm, np.zeros(3, int))):
        with Image.open(run.animate(tmp_path / "rise.gif", shapes=shapes)) as drawn:
            for number in (0, 2):
                drawn.seek(number)
                frames.append(np.asarray(drawn.convert("RGB"), int))
    assert frames[0].shape == frames[2].shape
    assert np.array_equal(frames[0], frames[2]) and not np.array_equal(frames[1], frames[3])


@pytest.mark.slow
@pytest.mark.run_once
def test_where_a_body_turns_is_differentiable(tank, model):
    """By its mass and its spin: forward, reverse, and central differences."""

    @jax.jit
    def turn(mass, spin):
        there = eqx.tree_at(lambda m: m.functional.walls.bodies.free.parts[0].mass, model, mass)
        start = eqx.tree_at(lambda s: s.bodies.spin, tank.state, spin[None])
        end = integrate(there, start, 0, jnp.asarray(DT), 2, 1)[0].bodies
        return jnp.sum(end.position) + 10.0 * jnp.vdot(end.angle[0], jnp.asarray(SPIN))

    at = (tank.walls.free.parts[0].mass, jnp.asarray(SPIN))
    way = (jnp.asarray(10.0), jnp.asarray([1.0, -0.5, 0.2]))
    slope = float(jax.jvp(turn, at, way)[1])
    pulled = jax.grad(turn, (0, 1))(*at)
    back = sum(float(jnp.vdot(a, b)) for a, b in zip(pulled, way, strict=True))
    assert back == pytest.approx(slope, rel=1e-9)
    ends = [turn(*(a + s * w for a, w in zip(at, way, strict=True))) for s in (1e-4, -1e-4)]
    assert slope == pytest.approx(float(ends[0] - ends[1]) / 2e-4, rel=1e-5)


@pytest.mark.run_once
def test_buoyancy_is_the_weight_of_the_displaced_water(tank):
    """Archimedes, of water at rest under its own weight around a cube with faces between rows."""
    cube = BoxRegion((0.4,) * 3, (1.0,) * 3)
    body, part = FreeBody.of_density(cube, 500.0, SPACE), WallPart("cube", cube)
    walls = Walls.around(TANK, SPACE, parts=(part,), free_bodies=(body,))
    x = fill(walls.start_region, Lattice().positions(SPACE))
    fluid = Fluid(1000.0, 100.0, 1.0)  # hardly compressed
    density = fluid.density(1000.0 * 9.81 * (SIDE - x[:, 2]))
    state = ParticleState(x, jnp.zeros_like(x), density)
    still = Scene("cube", tank.effects, fluid, SPACE, state, 1e-4, 1e-4, 1, {}, walls)
    forces, torques = WallForces.of(still)(still.model(margin=2.0), START, still.state)
    weight = 1000.0 * 9.81 * 0.6**3
    np.testing.assert_allclose(forces["cube"], -weight * DOWN, atol=0.03 * weight)  # as in 2D
    lever = torques["cube"] - np.cross(np.full(3, 0.7), forces["cube"])
    np.testing.assert_allclose(lever, 0.0, atol=1e-10 * weight)


def test_single_precision_stays_single(tank):
    single = jax.tree.map(lambda a: a.astype(jnp.float32), tank.state)
    narrow = dataclasses.replace(tank, state=single).model(margin=2.0)
    then = jax.eval_shape(
        lambda s: integrate(narrow, s, 0, jnp.asarray(DT, jnp.float32), 3, 1)[0], single
    )
    assert {leaf.dtype for leaf in jax.tree.leaves(then)} == {jnp.dtype(jnp.float32)}


REGION = BallRegion((0.7,) * 3, 0.35)
REFUSED = {
    "one moment for three": ((1.0, 1.0, (0.7,) * 3), "the inertia of .* has shape"),
    "a lopsided matrix": (
        (1.0, np.eye(3) + np.eye(3, k=1), (0.7,) * 3), "no symmetric matrix"
    ),
    "a moment below zero": ((1.0, np.diag([1.0, 1.0, -1.0]), (0.7,) * 3), "inertia .* positive"),
    "moments that no body has": ((1.0, np.diag([1.0, 1.0, 2.1]), (0.7,) * 3), "no body has"),
    "a spin that is a number": (
        (1.0, np.eye(3), (0.7,) * 3, (0.0,) * 3, 1.0), "the spin of .* has shape"
    ),
    "a centre in the plane": ((1.0, np.eye(3), (0.7,) * 2), "the center of .* has shape"),
}  # fmt: skip


@pytest.mark.parametrize(("given", "told"), REFUSED.values(), ids=REFUSED.keys())
def test_bad_bodies_are_refused(given, told):
    with pytest.raises(ValueError, match=told):
        Walls.around(TANK, SPACE, free_bodies=(FreeBody(REGION, *given),))


def test_a_region_through_a_face_is_refused():
    for region in (BoxRegion((0.4,) * 3, (1.0, 1.0, 1.8)), BallRegion((0.7, 0.3, 0.7), 0.35)):
        with pytest.raises(ValueError, match="goes through the box's face at [yz] ="):
            FreeBody.of_density(region, 500.0, SPACE)


def test_whole_numbers_are_taken():
    body = FreeBody.of_density(REGION, 500, SPACE, velocity=(0, 0, 1), spin=(0, 0, 5))
    assert body.spin.dtype == body.velocity.dtype == jnp.result_type(float)
