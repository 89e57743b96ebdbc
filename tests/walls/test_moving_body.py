"""Bodies that are moved: frames of reference, ghosts, gradients, and what is refused."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import (
    BallRegion,
    Box,
    BoxRegion,
    Fluid,
    MovingBody,
    ParticleState,
    Space,
    WalledSearch,
    Walls,
)
from jaxsph.arrangements import JitteredLattice, Lattice
from jaxsph.effects import (
    Continuity,
    DensityDiffusion,
    FreeSlip,
    LaminarViscosity,
    MovingFrame,
    NoSlip,
    ParticleShifting,
    PressureForce,
    WallPressure,
    WallRepulsion,
)
from jaxsph.integrate import AutomaticSteps, FaultCode, FixedSteps, integrate
from jaxsph.kernels import WendlandC2
from jaxsph.scenes import Scene
from jaxsph.schemes import delta_plus
from jaxsph.walls.walls import fill
from jaxsph_rom.points.dynamics.eulerian_rates import EulerianRates
from jaxsph_rom.points.dynamics.reference_operators import ReferenceOperators

DX = 0.1
FLUID = Fluid(1000.0, 10.0, 1.0)
ROOM = BoxRegion((-1.0, -0.8), (2.2, 1.8))
VESSEL = BoxRegion((0.0, 0.0), (1.0, 1.0))
SPACE = Space(Box(ROOM.lower, ROOM.upper, (False, False)), WendlandC2(), 2.0 * DX, DX)
SLIPS = {"no slip": NoSlip(), "free slip": FreeSlip()}


class Steady(eqx.Module):
    """d = U t"""

    velocity: jax.Array

    def __call__(self, time):
        return self.velocity * time


def test_a_motion_has_the_precision_of_its_time():
    """Whatever its constants have."""
    body = MovingBody(VESSEL, lambda t: np.array([0.5, 2.0]) * t.astype(float) ** 2)
    for dtype in (jnp.float32, jnp.float64):
        way, velocity, acceleration = body.motion(jnp.asarray(2.0, dtype))
        assert {each.dtype for each in (way, velocity, acceleration)} == {jnp.dtype(dtype)}
        np.testing.assert_allclose([way, velocity, acceleration], [[2, 8], [2, 8], [1, 4]])


class Shaken(eqx.Module):
    """d = A (1 - cos w t)"""

    amplitude: jax.Array
    frequency: float = 5.0

    def __call__(self, time):
        return self.amplitude * (1.0 - jnp.cos(self.frequency * time))


def scene(walls, slip, force=None, repelling=VESSEL, time_step=5e-3, velocity=(0.0, 0.0)):
    """A jittered, stirred, unevenly compressed fluid that fills the vessel."""
    rng = np.random.default_rng(3)
    x = fill(
        VESSEL, JitteredLattice(0.0).positions(SPACE), JitteredLattice(0.2, 1).positions(SPACE)
    )
    density = 1000.0 * (1.0 + 0.003 * rng.normal(size=len(x)))
    stirred = 0.3 * rng.normal(size=x.shape) + np.asarray(velocity)
    effects = (
        Continuity(),
        PressureForce(),
        LaminarViscosity(jnp.asarray(0.01)),
        DensityDiffusion(jnp.asarray(0.1)),
        ParticleShifting(),
        *(() if force is None else (force,)),
        WallPressure(),
        slip,
        WallRepulsion(repelling),
    )
    state = ParticleState(x, jnp.asarray(stirred), jnp.asarray(density))
    return Scene("vessel", effects, FLUID, SPACE, state, time_step, 0.4, 1, {}, walls)


def at_rest():
    return Walls.around(VESSEL, SPACE)


def moved(displacement):
    """The same vessel, its four walls one body."""
    return Walls.around(ROOM, SPACE, bodies=(MovingBody(~VESSEL, displacement),))


def run(scene, steps, stepping=FixedSteps(), interval=None):  # noqa: B008
    """The last state and the model's fault."""
    model, dt, interval = scene.model(), jnp.asarray(scene.time_step), interval or steps
    state, fault, _, _ = jax.jit(
        lambda s: integrate(model, s, 0, dt, interval, steps // interval, stepping)
    )(scene.state)
    assert int(fault.code) == FaultCode.NONE
    return state


# ------------------------------------------------------------------ frames of reference


@pytest.mark.parametrize(
    "slip",
    [
        pytest.param(SLIPS["no slip"], id="no slip"),
        pytest.param(SLIPS["free slip"], id="free slip", marks=pytest.mark.slow),
    ],
)
@pytest.mark.run_once
def test_a_vessel_at_constant_velocity_is_one_at_rest(slip):
    """Galilei. `ShiftingTransport` is left out: the paper's form of it depends on the frame."""
    boost, steps = jnp.asarray([1.5, -0.8]), 60  # to 4.5 and 2.4 dx away: lists are built anew
    still = run(scene(at_rest(), slip), steps)
    gone = run(scene(moved(Steady(boost)), slip, repelling=ROOM, velocity=boost), steps)
    way = boost[None, :] * steps * 5e-3
    assert jnp.abs(still.velocity).max() > 0.3  # something goes on
    # round-off: 2e-15 m, 2e-14 m/s and 2e-15 of the density measured
    np.testing.assert_allclose(gone.position - way, still.position, atol=1e-13)
    np.testing.assert_allclose(gone.velocity - boost[None, :], still.velocity, atol=1e-12)
    np.testing.assert_allclose(gone.density, still.density, rtol=1e-13)


@pytest.mark.run_once
def test_a_shaken_vessel_is_one_at_rest_under_inertia():
    """-d''(t) is a body force in the vessel's frame. A stage of RK4 knows where the vessel is
    exactly, and particles to the stage's order only: the two differ by O(dt^4)."""
    shaken, end, gaps = Shaken(jnp.asarray([0.08, -0.04])), 0.2, []
    for steps in (40, 80):
        dt = end / steps
        still = run(scene(at_rest(), NoSlip(), MovingFrame(shaken), time_step=dt), steps)
        gone = run(scene(moved(shaken), NoSlip(), repelling=ROOM, time_step=dt), steps)
        way, velocity, _ = MovingBody(VESSEL, shaken).motion(jnp.asarray(end))
        gap = gone.position - way[None, :] - still.position
        gaps.append(float(jnp.abs(gap).max()))
        assert jnp.abs(gone.velocity - velocity[None, :] - still.velocity).max() < 3e-6
    assert gaps[0] < 3e-8  # of a way of 3.7e-2 m; 1.6e-8 measured
    assert np.log2(gaps[0] / gaps[1]) == pytest.approx(4.0, abs=0.2)  # 3.97 measured


# ------------------------------------------------------------------ where a body is


def bar(time):
    return jnp.stack([0.3 * time**2, 0.0 * time])


TANK = BoxRegion((0.0, 0.0), (2.0, 1.0))
TANK_SPACE = Space(Box(TANK.lower, TANK.upper, (False, False)), WendlandC2(), 2.0 * DX, DX)
PISTON = BoxRegion((-np.inf, -np.inf), (0.6, np.inf))


def test_ghosts_go_with_their_body_and_only_these():
    walls = Walls.around(TANK, TANK_SPACE, bodies=(MovingBody(PISTON, bar),))
    fixed = Walls.around(TANK, TANK_SPACE)
    count = len(fixed.position)
    then = walls.at(jnp.asarray(2.0))
    for name in ("position", "normal", "velocity"):
        for at in (walls, then):
            np.testing.assert_array_equal(getattr(at, name)[:count], getattr(fixed, name))
    assert len(walls.position) == count + 4 * 10  # four layers between floor and lid
    np.testing.assert_allclose(then.position[count:] - walls.position[count:], [[1.2, 0.0]] * 40)
    np.testing.assert_allclose(then.velocity[count:], [[1.2, 0.0]] * 40)
    np.testing.assert_allclose(walls.normal[count:], [[1.0, 0.0]] * 40)
    acceleration = then.bodies.of_ghosts(then.bodies.acceleration)
    np.testing.assert_allclose(acceleration[count:], [[0.6, 0.0]] * 40)
    np.testing.assert_array_equal(acceleration[:count], 0.0)
    x = jnp.asarray([[0.5, 0.5], [0.7, 0.5], [1.7, 0.5], [1.9, 0.5], [2.1, 0.5]])
    np.testing.assert_array_equal(walls.beyond(x), [True, False, False, False, True])
    np.testing.assert_array_equal(then.beyond(x), [True, True, True, False, True])
    np.testing.assert_allclose(then.signed_distance(x)[2:4], [0.1, -0.1], atol=1e-14)
    again = then.at(jnp.asarray(0.0))
    np.testing.assert_allclose(again.position, walls.position, atol=1e-15)


def test_a_body_goes_through_a_periodic_face():
    box = Box((0.0, 0.0), (3.0, 3.0), (True, True))
    space = Space(box, WendlandC2(), 2.0 * DX, DX)
    ball = MovingBody(BallRegion((1.5, 1.5), 0.5), Steady(jnp.asarray([1.0, 0.0])))
    everywhere = BoxRegion((-np.inf,) * 2, (np.inf,) * 2)
    walls = Walls.around(everywhere, space, bodies=(ball,))
    assert np.linalg.norm(walls.position - 1.5, axis=1).max() < 0.5
    then = walls.at(jnp.asarray(1.4))  # its centre at 2.9
    x = jnp.asarray([[2.9, 1.5], [0.3, 1.5], [0.5, 1.5], [2.3, 1.5]])
    np.testing.assert_array_equal(then.beyond(x), [True, True, False, False])


def test_a_list_has_the_ghosts_where_they_are_and_lasts_until_one_has_gone_half_the_skin():
    walls = Walls.around(TANK, TANK_SPACE, bodies=(MovingBody(PISTON, bar),))
    x = fill(walls.start_region, Lattice().positions(TANK_SPACE))
    skin, support = 0.06, TANK_SPACE.support
    search = WalledSearch.allocate(
        x, walls.position, TANK_SPACE.box, support, skin, DX, 2.0, moving=True
    )
    build = jax.jit(lambda search, x: search.build(x))
    for time in (0.0, 0.9, 1.5):
        there = np.asarray(walls.at(jnp.asarray(time)).position)
        neighbors = build(search.moved(jnp.asarray(there)), x)
        assert not neighbors.overflow
        wall, count = neighbors.wall, neighbors.wall.near.shape[0]
        rows, slots = np.nonzero(np.asarray(wall.index) != np.arange(len(wall.index))[:, None])
        of_particle = rows < count
        entry = np.asarray(wall.index)[rows, slots][of_particle] - count
        number = np.asarray(neighbors.fluid.order)[np.asarray(wall.near)][rows[of_particle]]
        found = set(zip(number.tolist(), np.asarray(wall.ghosts)[entry].tolist(), strict=True))
        apart = np.linalg.norm(np.asarray(x)[:, None] - there[None], axis=2)
        exact = zip(*(a.tolist() for a in np.nonzero(apart < support + skin)), strict=True)
        assert found == set(exact)
    neighbors = build(search, x)
    for time, outdated in ((0.3, False), (0.33, True)):  # 0.027 m, 0.033 m; half the skin is 0.03 m
        now = search.moved(walls.at(jnp.asarray(time)).position)
        moved, particle = now.largest_motion(neighbors, x)
        assert moved == pytest.approx(0.3 * time**2, rel=1e-9) and particle == -1
        assert (moved > 0.5 * skin) == outdated


# ------------------------------------------------------------------ a body driven through fluid


def glide(time):
    """1 m within a second, from rest to rest."""
    share = jnp.clip(time, 0.0, 1.0)
    way = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    return jnp.stack([way, 0.0 * way])


def ball_scene(end_time):
    room = BoxRegion((0.0, 0.0), (3.0, 2.0))
    space = Space(Box(room.lower, room.upper, (False, False)), WendlandC2(), 2.0 * DX, DX)
    ball = MovingBody(BallRegion((1.0, 1.0), 0.45), glide)
    walls = Walls.around(room, space, bodies=(ball,))
    x = fill(walls.start_region, Lattice().positions(space))
    state = ParticleState(x, jnp.zeros_like(x), jnp.full(len(x), 1000.0))
    effects = (
        *delta_plus(LaminarViscosity(jnp.asarray(0.05))),
        WallPressure(),
        NoSlip(),
        WallRepulsion(room),
    )
    fluid = Fluid(1000.0, 20.0, 2.0)
    return Scene("ball", effects, fluid, space, state, 5e-3, end_time, 50, {}, walls)


def test_no_particle_is_run_over_by_a_ball():
    scene = ball_scene(1.0)
    state = run(scene, 200, AutomaticSteps(), interval=50)  # each step checks that none is in it
    x = np.asarray(state.position)
    distance = np.linalg.norm(x - np.asarray([2.0, 1.0]), axis=1) - 0.45
    # 0.13 dx measured: on a lattice its ghosts are up to a spacing behind a round surface, and the
    # repulsion within 0.15 dx of it does the rest
    assert distance.min() > 0.1 * DX
    # fluid has closed behind it and gone round it: the ball's old place is full
    old = np.linalg.norm(x - np.asarray([1.0, 1.0]), axis=1) < 0.45
    assert old.sum() * DX**2 == pytest.approx(np.pi * 0.45**2, rel=0.15)
    assert np.abs(np.asarray(state.density) / 1000.0 - 1.0).max() < 0.05


def test_steps_are_shorter_where_a_body_is_fast():
    model, state = ball_scene(1.0).model(), ball_scene(1.0).state
    rest, fast = (
        float(model.at(jnp.asarray(t)).step_limit(state, jnp.zeros(()))) for t in (0.0, 0.5)
    )
    # 1.5 h / (c0 + |u|), the ball's speed at half time 30 / 16 m/s
    assert rest == pytest.approx(1.5 * 0.2 / 20.0)
    assert fast == pytest.approx(1.5 * 0.2 / (20.0 + 1.875))


# ------------------------------------------------------------------ gradients


@pytest.mark.run_once
def test_derivatives_by_the_amplitude_fit_central_differences():
    start = scene(moved(Shaken(jnp.asarray([0.05, -0.02]))), NoSlip(), repelling=ROOM)
    model, dt = start.model(), jnp.asarray(start.time_step)
    weights = jnp.asarray(np.random.default_rng(0).normal(size=start.state.position.shape))

    def result(amplitude):
        ours = eqx.tree_at(
            lambda m: m.functional.walls.bodies.parts[0].displacement.amplitude, model, amplitude
        )
        end, fault, _, _ = integrate(ours, start.state, 0, dt, 12, 1)
        return jnp.sum(weights * (end.position + 0.1 * end.velocity)), fault.code

    amplitude, way = jnp.asarray([0.05, -0.02]), jnp.asarray([0.6, 0.8])
    forward = jax.jit(lambda a: jax.jvp(result, (a,), (way,), has_aux=True))
    (_, slope, code), epsilon = forward(amplitude), 1e-5
    assert int(code) == FaultCode.NONE
    ahead, behind = (forward(amplitude + s * epsilon * way)[0] for s in (1.0, -1.0))
    # truncation of the difference and round-off: 1e-10 and 1e-10 of values of order one
    assert float(slope) == pytest.approx(float((ahead - behind) / (2.0 * epsilon)), rel=1e-6)
    backward = jax.jit(jax.grad(result, has_aux=True))(amplitude)[0]
    assert float(backward @ way) == pytest.approx(float(slope), rel=1e-9)  # the same sums


# ------------------------------------------------------------------ what is refused


def around(region, displacement=bar):
    return Walls.around(TANK, TANK_SPACE, bodies=(MovingBody(region, displacement),))


REFUSED = {
    "elsewhere at the start": (
        r"the displacement of BoxRegion.* is .* m at t = 0; let it start from zero",
        lambda: around(PISTON, lambda t: jnp.stack([1.0 + t, t])),
    ),
    "no number": (
        "at t = 0; let it start from zero",
        lambda: around(PISTON, lambda t: jnp.stack([t / t, t])),
    ),
    "one component": (
        r"has shape \(1,\); let it give an array of the 2 components",
        lambda: around(PISTON, lambda t: t[None]),
    ),
    "a thin plate": (
        "about .* m thick, thinner than twice the kernel's support of 0.4 m",
        lambda: around(BoxRegion((0.6, -np.inf), (1.0, np.inf))),
    ),
    "a piston too near the wall behind": (
        "a fixed wall is nearer behind its face than the kernel's support of 0.4 m",
        lambda: around(BoxRegion((-np.inf, -np.inf), (0.3, np.inf))),
    ),
    "outside the fluid": (
        "moving body: no ghost lies in BoxRegion",
        lambda: around(BoxRegion((3.0, 0.0), (4.0, 1.0))),
    ),
}


@pytest.mark.parametrize("message, make", REFUSED.values(), ids=REFUSED.keys())
def test_bodies_that_do_not_hold_are_refused_in_one_line(message, make):
    with pytest.raises(ValueError, match=message) as refusal:
        make()
    assert "\n" not in str(refusal.value)


def test_a_particle_that_starts_in_a_body_is_refused():
    good = ball_scene(1.0)
    inside = eqx.tree_at(lambda s: s.position, good.state, good.state.position.at[7].set(1.0))
    with pytest.raises(ValueError, match="particles: number 7 at .* start inside a wall"):
        dataclasses.replace(good, state=inside)


@pytest.mark.parametrize("reduced", [EulerianRates, ReferenceOperators])
def test_reduced_models_refuse_moving_bodies(reduced):
    scene = ball_scene(1.0)
    with pytest.raises(ValueError, match="scene: bodies are moved through the fluid of ball"):
        reduced.of_scene(scene, scene.state.position)
