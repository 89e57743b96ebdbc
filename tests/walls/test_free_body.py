"""Bodies that the fluid moves: momentum, frames of reference, derivatives, and what is refused."""

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
    ForcesOverTime,
    FreeBody,
    MovingBody,
    ParticleState,
    Space,
    WallForces,
    WallPart,
    Walls,
)
from jaxsph.arrangements import JitteredLattice, Lattice
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
from jaxsph.full_model import body_checks
from jaxsph.integrate import AutomaticSteps, Fault, FaultCode, FixedSteps, integrate
from jaxsph.kernels import WendlandC2
from jaxsph.likely_cause import squeezed_water
from jaxsph.scenes import Scene
from jaxsph.schemes import Consistent
from jaxsph.walls.walls import fill

DX, G, START = 0.1, 1.0, jnp.zeros(())
FLUID = Fluid(1000.0, 10.0, 1.0)
TANK = BoxRegion((0.0, 0.0), (2.0, 2.0))
EVERYWHERE = BoxRegion((-np.inf,) * 2, (np.inf,) * 2)
BALL = BallRegion((1.05, 0.97), 0.42)
SPACE = Space(Box((0.0, 0.0), (2.0, 2.0), (False, False)), WendlandC2(), 2.0 * DX, DX)
PERIODIC = Space(Box((0.0, 0.0), (2.0, 2.0), (True, True)), WendlandC2(), 2.0 * DX, DX)


def scene(space=SPACE, region=TANK, velocity=(0.0, 0.0), density=700.0, gravity=G, spin=0.5):
    """A jittered, stirred, unevenly compressed fluid around a ball that turns; what conserves
    momentum in the fluid."""
    ball = FreeBody.of_density(BALL, density, space, velocity, spin)
    walls = Walls.around(region, space, parts=(WallPart("ball", BALL),), free_bodies=(ball,))
    rng = np.random.default_rng(3)
    x = fill(walls.start_region, Lattice().positions(space),
             JitteredLattice(0.2, 1).positions(space))  # fmt: skip
    x = jnp.where(walls.signed_distance(x)[:, None] > -0.2 * DX,
                  fill(walls.start_region, Lattice().positions(space)), x)  # fmt: skip
    effects = (
        Continuity(),
        PressureForce(),
        LaminarViscosity(jnp.asarray(0.01)),
        DensityDiffusion(jnp.asarray(0.1)),
        *((Gravity(jnp.asarray([0.0, -gravity])),) if gravity else ()),
        WallPressure(),
        NoSlip(),
        WallRepulsion(region),
    )
    stirred = 0.3 * rng.normal(size=x.shape) + np.asarray(velocity)
    density = 1000.0 * (1.0 + 0.003 * rng.normal(size=len(x)))
    state = ParticleState(x, jnp.asarray(stirred), jnp.asarray(density))
    return Scene("free", effects, FLUID, space, state, 2e-3, 0.4, 1, {}, walls)


@pytest.fixture(scope="module")
def tank():
    return scene()


@pytest.fixture(scope="module")
def model(tank):
    return tank.model(margin=2.0)


@pytest.fixture(scope="module")
def run(model):
    """The state after ten steps, of a model's mass and a start."""

    def ten(mass, state):
        where = lambda m: m.functional.walls.bodies.free.parts[0].mass  # noqa: E731
        return integrate(eqx.tree_at(where, model, mass), state, 0, jnp.asarray(2e-3), 10, 1)[:2]

    return jax.jit(ten)


# ------------------------------------------------------------------ the body


def test_mass_centre_and_moment_of_inertia_are_those_of_the_region():
    box = FreeBody.of_density(BoxRegion((0.4, 0.5), (1.6, 1.3)), 500.0, SPACE)
    assert float(box.mass) == pytest.approx(500.0 * 1.2 * 0.8, rel=1e-12)  # faces between cells
    np.testing.assert_allclose(box.center, [1.0, 0.9], atol=1e-12)
    assert float(box.inertia) == pytest.approx(480.0 * (1.2**2 + 0.8**2) / 12.0, rel=1e-12)
    ball = FreeBody.of_density(BALL, 1.0, SPACE)
    # second order in a part of dx / 8
    assert float(ball.mass) == pytest.approx(np.pi * 0.42**2, rel=1e-3)
    np.testing.assert_allclose(ball.center, BALL.center, atol=1e-4)
    assert float(ball.inertia) == pytest.approx(0.5 * np.pi * 0.42**4, rel=2e-3)


def test_ghosts_go_and_turn_with_their_body(tank):
    walls, start = tank.walls, tank.walls.free.state
    own = np.asarray(walls.free.owner) == 0
    angle, way = 0.7, jnp.asarray([[0.2, -0.1]])
    state = eqx.tree_at(
        lambda s: (s.angle, s.position), start, (jnp.asarray([angle]), start.position + way)
    )
    then = walls.at(START, state)
    np.testing.assert_array_equal(then.position[~own], walls.position[~own])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    arm = np.asarray(walls.position[own] - start.position)
    expected = arm @ turn.T + np.asarray(start.position + way)
    np.testing.assert_allclose(then.position[own], expected, atol=1e-14)
    np.testing.assert_allclose(then.normal[own], np.asarray(walls.normal[own]) @ turn.T, atol=1e-14)
    # a ball's surface moves along itself, at w R, whatever the ghost's depth
    spin = np.asarray(then.velocity[own])
    np.testing.assert_allclose(np.linalg.norm(spin, axis=1), 0.5 * 0.42, rtol=1e-3)
    np.testing.assert_allclose((spin * np.asarray(then.normal[own])).sum(axis=1), 0.0, atol=1e-3)
    back = then.at(START, start)
    for name in ("position", "normal", "velocity"):
        np.testing.assert_allclose(getattr(back, name), getattr(walls, name), atol=1e-14)
    x = jnp.asarray([[1.1, 0.5], [1.25, 0.5], [1.25, 0.4]])
    np.testing.assert_array_equal(walls.beyond(x), [False, False, False])
    np.testing.assert_array_equal(then.beyond(x), [True, True, False])


# ------------------------------------------------------------------ momentum


@pytest.mark.run_once
def test_the_body_gets_what_the_fluid_gives(tank, model):
    """Force on all walls, weight of the fluid and rate of its momentum; the body's own rates are
    those of the force and the torque on its part of the walls."""
    forces, torques = WallForces.of(tank)(model, START, tank.state)
    rates = eqx.filter_jit(model.rates)(START, tank.state, model.prepare(tank.state))
    ball, start = tank.walls.free.parts[0], tank.state.bodies
    largest = np.abs(forces["walls"]).max()
    fluid = tank.mass * np.asarray(rates.velocity).sum(axis=0)
    weight = np.array([0.0, -G])
    fixed = np.asarray(forces["walls"] - forces["ball"])
    body = float(ball.mass) * np.asarray(rates.bodies.velocity[0])
    total = weight * (float(tank.mass) * len(tank.state.position) + float(ball.mass))
    # the terms' own size, and some thousand of them are added
    np.testing.assert_allclose(fluid + body + fixed, total, atol=1e-10 * largest)
    assert np.abs(body - float(ball.mass) * weight).max() > 0.01 * largest, "a force that is there"
    x, y = np.asarray(start.position[0])
    lever = torques["ball"] - (x * forces["ball"][1] - y * forces["ball"][0])
    torque = float(ball.inertia * rates.bodies.spin[0])
    assert torque == pytest.approx(float(lever), abs=1e-10 * largest)
    np.testing.assert_array_equal(rates.bodies.position, start.velocity)
    np.testing.assert_array_equal(rates.bodies.angle, start.spin)


@pytest.mark.run_once
def test_momentum_is_kept_step_by_step(tank, model):
    """Change of momentum of fluid and body, impulse on the fixed walls, and weight over time."""
    beside, dt, steps = ForcesOverTime(model, WallForces.of(tank)), 2e-3, 5
    end, fault, _, _ = jax.jit(
        lambda s: integrate(beside, beside.start(s), 0, jnp.asarray(dt), steps, 1)
    )(tank.state)
    assert int(fault.code) == FaultCode.NONE
    inert = float(tank.walls.free.parts[0].mass)
    gained = tank.mass * np.asarray(end.particles.velocity - tank.state.velocity).sum(axis=0)
    gained += inert * np.asarray(end.particles.bodies.velocity - tank.state.bodies.velocity)[0]
    impulse = np.asarray(end.impulse.force[0] - end.impulse.force[1])
    weight = np.array([0.0, -G * (inert + float(tank.mass) * len(tank.state.position))])
    largest = np.abs(end.impulse.force).max()
    np.testing.assert_allclose(gained + impulse, weight * steps * dt, atol=1e-10 * largest)


@pytest.mark.slow
@pytest.mark.run_once
def test_a_body_in_a_stream_is_one_at_rest():
    """Galilei, in a periodic box: the body crosses its face, and lists are built anew. Momentum of
    fluid and body together is kept."""
    boost, steps, ends = (3.0, 1.0), 150, []
    for velocity in ((0.0, 0.0), boost):
        flow = scene(PERIODIC, EVERYWHERE, velocity, gravity=0.0)
        model = flow.model(margin=2.0)
        end, fault, _, _ = jax.jit(
            lambda s, model=model: integrate(model, s, 0, jnp.asarray(2e-3), steps, 1)
        )(flow.state)
        assert int(fault.code) == FaultCode.NONE
        inert = float(flow.walls.free.parts[0].mass)
        before, after = (
            flow.mass * jnp.sum(s.velocity, axis=0) + inert * s.bodies.velocity[0]
            for s in (flow.state, end)
        )
        np.testing.assert_allclose(after, before, atol=1e-10 * inert)
        ends.append(end)
    way = jnp.asarray(boost) * steps * 2e-3
    still, gone = ends
    assert float(gone.bodies.position[0, 0]) + 0.42 > 2.0 > float(still.bodies.position[0, 0])
    assert jnp.abs(still.bodies.velocity).max() > 1e-3  # something goes on
    # round-off, which the flow's own disorder lets grow
    np.testing.assert_allclose(gone.bodies.position - way[None], still.bodies.position, atol=1e-10)
    np.testing.assert_allclose(gone.bodies.angle, still.bodies.angle, atol=1e-10)
    np.testing.assert_allclose(gone.bodies.spin, still.bodies.spin, atol=1e-9)


# ------------------------------------------------------------------ derivatives, maps


@pytest.mark.slow
@pytest.mark.run_once
def test_where_a_body_goes_is_differentiable(tank, run):
    """By its mass and by its spin at the start: forward, reverse, and central differences."""
    mass, state = tank.walls.free.parts[0].mass, tank.state

    def height(mass, spin):
        start = eqx.tree_at(lambda s: s.bodies.spin, state, spin)
        bodies = run(mass, start)[0].bodies
        return bodies.position[0, 1] + 0.1 * bodies.angle[0]

    at, way = (mass, state.bodies.spin), (100.0 * jnp.ones(()), jnp.ones(1))
    slope = float(jax.jvp(height, at, way)[1])
    pulled = jax.grad(height, (0, 1))(*at)
    assert float(sum(jnp.vdot(a, b) for a, b in zip(pulled, way, strict=True))) == pytest.approx(
        slope, rel=1e-9
    )
    ends = [height(*(a + s * w for a, w in zip(at, way, strict=True))) for s in (1e-3, -1e-3)]
    assert slope == pytest.approx(float(ends[0] - ends[1]) / 2e-3, rel=1e-5)


@pytest.mark.slow
@pytest.mark.run_once
def test_masses_are_mapped(tank, run):
    masses = tank.walls.free.parts[0].mass * jnp.asarray([0.5, 1.0, 2.0])
    ends, _ = jax.vmap(run, (0, None))(masses, tank.state)
    alone, fault = run(masses[2], tank.state)
    assert int(fault.code) == FaultCode.NONE
    np.testing.assert_allclose(ends.bodies.velocity[2], alone.bodies.velocity, rtol=1e-10)
    speed = np.abs(ends.bodies.velocity[:, 0, 1])
    assert np.ptp(speed) > 1e-4, "mass matters"


# ------------------------------------------------------------------ light bodies, faults


def test_a_light_body_has_a_shorter_step():
    """As an oscillator on the layer of fluid beside it; the run of one at the shorter step goes on,
    while the step that serves a heavy one is refused."""
    shares = {}
    for ratio in (10.0, 0.1, 0.01):
        ball = FreeBody.of_density(BALL, 1000.0 * ratio, SPACE)
        free = Walls.around(TANK, SPACE, free_bodies=(ball,)).free
        shares[ratio] = float(free.step_share(jnp.asarray(1000.0)))
        layer = DX / (0.42 * ratio)  # rho0 dx pi R, of M = rho pi R^2
        # ghosts nearer than a spacing to the surface stand for it: 12 percent of it measured
        assert shares[ratio] == pytest.approx((1.0 + layer) ** -0.5, rel=0.1)
    light = scene(density=10.0)
    limit = light.stable_time_step
    assert limit == pytest.approx(1.5 * 0.2 / 10.0 * shares[0.01], rel=1e-9)
    with pytest.raises(ValueError, match="where a free body is light"):
        dataclasses.replace(light, time_step=0.02)
    chosen = light.model().step_limit(light.state, START)
    assert float(chosen) < limit


@pytest.mark.run_once
def test_a_body_at_a_wall_is_a_fault(tank, model):
    down = jnp.asarray([[0.0, -0.551]])  # to a millimetre beyond the floor
    state = eqx.tree_at(lambda s: s.bodies.position, tank.state, tank.state.bodies.position + down)
    neighbors, inspect = model.prepare(tank.state), eqx.filter_jit(model.inspect)
    fault = inspect(jnp.asarray(3), state, neighbors)
    assert int(fault.code) == FaultCode.BODY_MET_WALL and int(fault.step) == 3
    lost = eqx.tree_at(lambda s: s.bodies.spin, tank.state, jnp.asarray([jnp.nan]))
    assert int(inspect(jnp.asarray(3), lost, neighbors).code) == FaultCode.NOT_FINITE


def test_the_cause_of_a_fault_is_named_where_a_body_is_close_to_a_wall(tank):
    start = tank.state.bodies
    assert squeezed_water(tank.walls, SPACE) is None
    for way, told in ((0.4, "1.5"), (0.3, "2.5"), (0.2, None)):  # 0.97 - 0.42 m off the floor
        down = eqx.tree_at(lambda s: s.position, start, start.position - jnp.asarray([[0.0, way]]))
        found = squeezed_water(tank.walls.at(START, down), SPACE)
        assert found is None if told is None else f"free body 0 is {told} spacings" in found


def test_two_bodies_that_meet_are_a_fault():
    space = Space(Box((0.0, 0.0), (4.0, 2.0), (False, False)), WendlandC2(), 2.0 * DX, DX)
    tank = BoxRegion((0.0, 0.0), (4.0, 2.0))
    balls = [
        FreeBody.of_density(BallRegion((x, 1.0), 0.5), 500.0, space) for x in (1.0, 2.95)
    ]
    walls = Walls.around(tank, space, free_bodies=balls)
    start, nearer = walls.free.state, jnp.asarray([[0.5, 0.0], [-0.5, 0.0]])
    for way, expected in ((0.0 * nearer, FaultCode.NONE), (nearer, FaultCode.BODY_MET_WALL)):
        there = eqx.tree_at(lambda s: s.position, start, start.position + way)
        fault = Fault.first_of(jnp.asarray(1), *body_checks(walls.at(START, there)))
        assert int(fault.code) == expected


@pytest.mark.slow
@pytest.mark.run_once
def test_automatic_steps_are_equal_ones_of_their_length(tank, model):
    end, count = 0.04, int(np.ceil(0.04 / float(model.step_limit(tank.state, START))))
    ends = []
    for how, steps in ((AutomaticSteps(), 20), (FixedSteps(), count)):
        new, fault = jax.jit(
            lambda s, how=how, n=steps: integrate(model, s, 0, jnp.asarray(end / n), n, 1, how)[:2]
        )(tank.state)
        assert int(fault.code) == FaultCode.NONE
        ends.append(new.bodies)
    assert 1 < count < 20
    np.testing.assert_allclose(ends[0].position, ends[1].position, rtol=1e-12)
    np.testing.assert_allclose(ends[0].spin, ends[1].spin, rtol=1e-9)  # round-off, grown


# ------------------------------------------------------------------ programs, precision


def test_a_scene_without_free_bodies_has_nothing_of_them_in_its_program():
    moved = MovingBody(BALL, lambda t: jnp.stack([0.1 * t**2, 0.0 * t]))
    made = {
        "given": Walls.around(TANK, SPACE, bodies=(moved,)),
        "free": Walls.around(TANK, SPACE, free_bodies=(FreeBody.of_density(BALL, 1.0, SPACE),)),
    }
    texts = {}
    for name, walls in made.items():
        x = fill(walls.start_region, Lattice().positions(SPACE))
        state = ParticleState(x, jnp.zeros_like(x), jnp.full(len(x), 1000.0))
        effects = (Continuity(), PressureForce(), WallPressure(), WallRepulsion(TANK))
        flow = Scene(name, effects, FLUID, SPACE, state, 1e-3, 0.4, 1, {}, walls)
        model = flow.model()
        texts[name] = (
            jax.jit(lambda s, model=model: integrate(model, s, 0, jnp.asarray(1e-3), 2, 1))
            .lower(flow.state).as_text()
        )  # fmt: skip
    assert "stablehlo.cosine" in texts["free"]  # of a body's angle
    assert "stablehlo.cosine" not in texts["given"]


@pytest.mark.slow
@pytest.mark.run_once
def test_single_precision_stays_single(tank):
    state = jax.tree.map(lambda a: a.astype(jnp.float32), tank.state)
    single = dataclasses.replace(tank, state=state)
    model = single.model(margin=2.0)
    end, fault, _, _ = jax.jit(
        lambda s: integrate(model, s, 0, jnp.asarray(2e-3, jnp.float32), 3, 1)
    )(single.state)
    assert int(fault.code) == FaultCode.NONE
    assert {leaf.dtype for leaf in jax.tree.leaves(end)} == {jnp.dtype(jnp.float32)}


# ------------------------------------------------------------------ what is refused


REFUSED = {
    "a density below zero": (
        lambda: FreeBody.of_density(BALL, -1.0, SPACE), "density must be positive"
    ),
    "a region out of the box": (
        lambda: FreeBody.of_density(BallRegion((9.0, 9.0), 0.5), 1.0, SPACE), "no place of the box"
    ),
    "no mass": (
        lambda: Walls.around(
            TANK, SPACE, free_bodies=(FreeBody(BALL, 0.0, 1.0, BALL.center),)
        ),
        "the mass of .* must be positive",
    ),
    "a velocity in three dimensions": (
        lambda: Walls.around(
            TANK, SPACE, free_bodies=(FreeBody(BALL, 1.0, 1.0, BALL.center, (0.0,) * 3),)
        ),
        "the velocity of .* has shape",
    ),
    "a thin body": (
        lambda: Walls.around(
            TANK, SPACE,
            free_bodies=(FreeBody.of_density(BallRegion((1.0, 1.0), 0.3), 1.0, SPACE),),
        ),
        "thinner than twice",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("make", "told"), REFUSED.values(), ids=REFUSED.keys())
def test_bad_bodies_are_refused(make, told):
    with pytest.raises(ValueError, match=told):
        make()


@pytest.mark.parametrize("name", ["AdjointPressure", "ConsistentViscosity"])
def test_effects_that_do_not_know_free_bodies_are_refused(tank, name):
    known = {effect.name: effect for effect in Consistent().effects(0.01, None, TANK)}
    gone = "PressureForce" if name == "AdjointPressure" else "LaminarViscosity"
    others = tuple(effect for effect in tank.effects if effect.name != gone)
    effects = (known["KernelCorrection"], known[name], *others)
    model = dataclasses.replace(tank, effects=effects).model()
    neighbors = model.prepare(tank.state)
    with pytest.raises(ValueError, match=f"effects: {name}"):
        jax.eval_shape(model.rates, START, tank.state, neighbors)
