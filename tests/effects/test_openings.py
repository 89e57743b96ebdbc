"""What comes in through openings and goes out: places, numbers, derivatives, what is parked."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import Box, Fluid, ParticleState, SimulationError, run_scene
from jaxsph.arrangements import Lattice
from jaxsph.cli.recorded import _errors
from jaxsph.effects import FreeSlip, Opening, Openings, UniformProfile
from jaxsph.history import read_history
from jaxsph.integrate import FaultCode, integrate
from jaxsph.io import read_snapshot, read_trajectory, snapshot_blocks
from jaxsph.parking import Parking, flowing
from jaxsph.scenes import OpenEnds, Scale, composed, continued, flow_through, poiseuille_open
from jaxsph.scenes.ends import buffer_lengths, buffer_rate, put_at_openings
from jaxsph.schemes import Consistent
from jaxsph.sweeps import read_member, sweep
from jaxsph.walls import BoxRegion
from jaxsph_rom.still_walls import check_still

ACROSS = BoxRegion((-np.inf, 0.0), (np.inf, 1.0))


def stream(ends=None, steps=40, dtype=None, speed=1.0, inflow=None):
    """A plug between walls that slip, 8 across."""
    return flow_through(
        "plug",
        length=1.5,
        ends=OpenEnds() if ends is None else ends,
        across=(0.0, 1.0),
        region=ACROSS,
        side=1.0,
        speed=1.0,
        inflow=UniformProfile(speed) if inflow is None else inflow,
        viscosity=0.1,
        scale=Scale(8, 1.5, 0.0125, 10),
        mach=0.1,
        end_time=0.0125 * steps,
        arrangement=Lattice(),
        wall_velocity=FreeSlip(),
        dtype=dtype,
        parameters={},
    )


@pytest.fixture(scope="module")
def plug():
    scene = stream()
    return scene, run_scene(scene)


def in_flow(scene):
    return len(flowing(scene.state.position, scene.parking))


def openings_of(scene):
    (effect,) = (e for e in scene.effects if isinstance(e, Openings))
    return effect


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_a_plug_goes_through_as_it_came_in(plug, dtype):
    scene, flow = plug
    if dtype == "float32":
        scene = stream(dtype=dtype)
        flow = run_scene(scene)
    round_off = 1e-12 if dtype == "float64" else 1e-5
    assert flow.velocity.dtype == dtype
    for k, time in enumerate(flow.time):
        there = flow.active[k]
        u = flow.velocity[k][there]
        np.testing.assert_allclose(u, np.broadcast_to([1.0, 0.0], u.shape), atol=round_off)
        np.testing.assert_allclose(flow.density[k][there], 1.0, atol=round_off)
        # columns a spacing apart all along the box, whatever has been put in and parked by then
        x = np.sort(flow.position[k][there][:, 0]).reshape(-1, 8)
        np.testing.assert_allclose(np.ptp(x, axis=1), 0.0, atol=round_off)
        np.testing.assert_allclose(np.diff(x[:, 0]), 0.125, atol=round_off)
        assert x[0, 0] < scene.space.box.lower[0] + 0.125 + time * 1e-9
    assert (flow.active.sum(axis=1) < flow.particles).all()


def test_parked_particles_stay_where_they_are(plug):
    scene, flow = plug
    place = openings_of(scene).parking.place
    for k in range(len(flow.time)):
        away = ~flow.active[k]
        there = flow.position[k][away]
        np.testing.assert_array_equal(there, np.broadcast_to(place, there.shape))
        assert not flow.velocity[k][away].any() and (flow.density[k][away] == 1.0).all()
    came_back = np.diff(flow.position[:, :, 0], axis=0) < -0.5  # at the inlet, from the outlet
    assert came_back.any()


def test_nobody_is_a_neighbour_of_what_is_parked():
    scene = stream()
    position = scene.state.position
    search = scene.search()
    fewer = dataclasses.replace(
        scene, state=jax.tree.map(lambda a: a[: in_flow(scene)], scene.state)
    ).search()
    assert (search.fluid.capacity, search.capacity) == (fewer.fluid.capacity, fewer.capacity)
    built = search.build(position)
    own = np.arange(len(position))[:, None]
    listed = np.asarray(built.fluid.index) != own
    parked = np.asarray(scene.parking.holds(position))[np.asarray(built.fluid.order)]
    assert parked.any() and not listed[parked].any() and listed[~parked].any(axis=1).all()
    assert not parked[np.asarray(built.fluid.index)[~parked]].any()
    assert not bool(built.overflow)


def an_opening(inward=1.0, axis=0, dim=2, **conditions):
    lower, upper = [0.0] * dim, [1.0] * dim
    lower[axis], upper[axis] = 2.0, 3.0
    settings = {"velocity": None, "pressure": None, "pressure_rate": None}
    settings |= {"reserve": 0.5, "cell": 0.25, "axis": axis, "inward": inward} | conditions
    return Opening(lower=tuple(lower), upper=tuple(upper), **settings)


@pytest.mark.parametrize("inward, mouth", [(1.0, 3.0), (-1.0, 2.0)])
@pytest.mark.parametrize("axis, dim", [(0, 2), (1, 2), (2, 3)])
def test_depths_shares_and_borders(inward, mouth, axis, dim):
    opening = an_opening(inward, axis, dim)

    def at(depth, across=0.5):
        place = np.full((1, dim), across)
        place[0, axis] = mouth - inward * depth
        return jnp.asarray(place)

    assert float(opening.depth(at(0.3))[0]) == pytest.approx(0.3)
    np.testing.assert_allclose(opening.behind(at(0.3)), at(0.8))
    for depth, prescribed, left_open in ((-0.1, 0, 0), (0.35, 1, 0), (0.5, 1, 1), (0.9, 1, 1)):
        shares = opening.shares(at(depth))
        assert [float(share[0]) for share in shares] == pytest.approx([prescribed, left_open])
        assert not any(float(share[0]) for share in opening.shares(at(depth, across=1.2)))
    assert bool(opening.entering(at(0.49), at(0.51))[0])
    assert not bool(opening.entering(at(0.51), at(0.49))[0])
    assert not bool(opening.entering(at(0.49, 1.2), at(0.51, 1.2))[0])
    assert bool(opening.leaving(at(1.01))[0]) and not bool(opening.leaving(at(0.99))[0])


@pytest.mark.parametrize("dim", [2, 3])
def test_the_front_is_read_by_places_across_the_mouth(dim):
    """Means over cells of a linear field are that field away from the mouth's rim."""
    opening = an_opening(dim=dim, cell=0.125)
    ticks = (np.arange(16) + 0.5) / 16.0
    along = 3.0 - 0.35 * ticks[::4]  # four columns in the front
    position = np.stack(np.meshgrid(along, *[ticks] * (dim - 1), indexing="ij"), axis=-1)
    position = jnp.asarray(position.reshape(-1, dim))
    slope = jnp.arange(1.0, dim)
    linear = jnp.sum(position[:, 1:] * slope[None], axis=1)
    values = jnp.stack([linear, jnp.full_like(linear, 7.0)], axis=1)
    found = opening.in_front(position, values)
    inner = np.all(np.abs(np.asarray(position[:, 1:]) - 0.5) < 0.3, axis=1)
    assert inner.any()
    np.testing.assert_allclose(found[inner, 0], linear[inner], atol=1e-12)
    np.testing.assert_allclose(found[:, 1], 7.0, atol=1e-12)
    # where no particle is in the front each has its own
    np.testing.assert_array_equal(opening.in_front(position.at[:, 0].add(-3.0), values), values)


class Along(eqx.Module):
    """A uniform velocity along an axis."""

    speed: jax.Array
    axis: int = eqx.field(static=True)

    def __call__(self, position, time):
        return jnp.zeros_like(position).at[:, self.axis].set(self.speed)


@pytest.mark.parametrize("dim, axis, speed", [(2, 1, -1.0), (3, 2, 1.0)])
def test_a_stream_goes_through_along_any_axis_and_either_way(dim, axis, speed):
    dx, (front, reserve) = 0.125, buffer_lengths(0.325, 0.125)
    lower, upper, periodic = [0.0] * dim, [1.0] * dim, [True] * dim
    lower[axis], upper[axis], periodic[axis] = -front - reserve, 1.0 + front + reserve, False
    box = Box(tuple(lower), tuple(upper), tuple(periodic))
    inflow = Along(jnp.asarray(speed), axis)
    scene = composed(
        "stream",
        effects=Consistent().effects(0.01),
        box=box,
        scale=Scale(8, 1.3, 0.012, 5),
        end_time=0.24,
        reference_density=1.0,
        reference_speed=1.0,
        side=1.0,
        velocity=lambda x: inflow(x, 0.0),
        arrangement=Lattice(),
    )
    low, high = list(upper), list(lower)
    low[axis], high[axis] = 0.0, 1.0
    sides = [(box.lower, tuple(low)), (tuple(high), box.upper)]
    sides = sides if speed > 0.0 else sides[::-1]
    sizes = {"axis": axis, "reserve": reserve, "cell": dx}
    way = float(np.sign(speed))
    inlet = Opening(inflow, None, None, *sides[0], inward=way, **sizes)
    outlet = Opening(None, jnp.zeros(()), jnp.ones(()), *sides[1], inward=-way, **sizes)
    ends = Openings((inlet, outlet), buffer_rate(scene), Parking(box, axis))
    everywhere = BoxRegion((-np.inf,) * dim, (np.inf,) * dim)
    flow = run_scene(put_at_openings(scene, ends, everywhere, 64))
    assert (flow.active.sum(axis=1) == scene.state.position.shape[0]).all()
    there = flow.active[-1]
    np.testing.assert_allclose(flow.velocity[-1][there][:, axis], speed, rtol=1e-12)
    np.testing.assert_allclose(flow.density[-1][there], 1.0, rtol=1e-12)
    jumped = np.abs(np.diff(flow.position[:, :, axis], axis=0)) > 0.5
    assert jumped.any()  # from the outlet's end to the inlet's


def exchange(position, since, parked=2, velocity=None):
    """Particles on their way past two openings, and so many parked."""
    box = Box((0.0, 0.0), (4.0, 1.0), (False, False))
    sides = [
        Opening(None, None, None, (0.0, 0.0), (1.0, 1.0), 0, 1.0, 0.5, 0.25),
        Opening(None, jnp.zeros(()), jnp.ones(()), (3.0, 0.0), (4.0, 1.0), 0, -1.0, 0.5, 0.25),
    ]
    effect = Openings(tuple(sides), 1.0, Parking(box))
    place = jnp.broadcast_to(jnp.asarray(effect.parking.place), (parked, 2))
    position, since = (jnp.concatenate([jnp.asarray(x), place]) for x in (position, since))
    count = len(position)
    speed = jnp.arange(2.0 * count).reshape(count, 2) if velocity is None else velocity
    state = ParticleState(position, speed, 1.0 + 0.01 * jnp.arange(float(count)))
    fluid = Fluid(jnp.asarray(1.0), jnp.asarray(10.0), jnp.asarray(1.0))
    return effect, state, since, effect.exchanged(state, since, fluid)


def test_what_comes_out_of_a_reserve_is_put_in_once_more_behind_it():
    since = [[0.45, 0.2], [0.48, 0.7], [2.0, 0.5], [3.95, 0.4]]
    now = [[0.55, 0.2], [0.49, 0.7], [2.1, 0.5], [4.05, 0.4]]
    effect, old, at, new = exchange(now, since)
    np.testing.assert_allclose(new.position[:3], now[:3])
    # the first place that is free is that of the one that left
    np.testing.assert_allclose(new.position[3], [0.05, 0.2])
    np.testing.assert_array_equal(new.velocity[3], old.velocity[0])
    assert float(new.density[3]) == float(old.density[0])
    assert effect.parking.holds(new.position).tolist() == [False] * 4 + [True] * 2
    assert not bool(effect.exhausted(old.position, at))
    # and back again: through the outlet in, out at the inlet's end
    effect, old, at, new = exchange([[3.45, 0.3], [-0.1, 0.6]], [[3.55, 0.3], [0.1, 0.6]], 0)
    np.testing.assert_allclose(new.position, [[3.45, 0.3], [3.95, 0.3]])


def test_none_parked_is_a_fault_with_its_name():
    came = ([[0.55, 0.2], [0.55, 0.6]], [[0.45, 0.2], [0.45, 0.6]])
    effect, old, at, _ = exchange(*came, parked=1)
    assert bool(effect.exhausted(old.position, at))
    effect, old, at, _ = exchange(*came, parked=2)
    assert not bool(effect.exhausted(old.position, at))
    # a column comes in before one has gone out
    scene = stream(OpenEnds(spare=0.0), steps=10)
    outlet = openings_of(scene).openings[1]
    first = scene.state.position[:, 0] < outlet.upper[0] - 0.13  # the last column is not there yet
    shorter = dataclasses.replace(scene, state=jax.tree.map(lambda a: a[first], scene.state))
    with pytest.raises(SimulationError, match="more particles come in .* than are parked; park"):
        run_scene(shorter)


def test_a_run_taken_up_again_is_the_unbroken_one(plug, tmp_path):
    scene, flow = plug
    path = tmp_path / "run.h5"

    class Killed(Exception):
        pass

    def kill(steps, done=[0]):  # noqa: B006
        done[0] += steps
        if done[0] >= scene.steps // 2:
            raise Killed

    with pytest.raises(Killed):
        run_scene(scene, path, progress=kill)
    taken_up = run_scene(scene, path)
    for name in ("position", "velocity", "density", "active"):
        np.testing.assert_array_equal(getattr(taken_up, name), getattr(flow, name))
    # and files know who is in the flow
    stored = read_trajectory(path)
    np.testing.assert_array_equal(stored.active, flow.active)
    np.testing.assert_array_equal(
        np.concatenate([block.active for block in snapshot_blocks(path, 2)]), flow.active
    )
    _, last = read_snapshot(path)
    shown = last.in_flow()
    assert len(shown.position) == flow.active[-1].sum() and shown.active is None
    assert shown.position[:, 0].min() > scene.space.box.lower[0] - 0.1


@pytest.mark.run_once
def test_derivatives_are_those_of_the_flow():
    """The mean speed in a channel by the inflow's, forward and reverse, beside differences."""
    scene = poiseuille_open(8, ends="openings", h_over_dx=1.5, end_time=0.05)
    model, schedule = scene.model(), scene.schedule
    number = [isinstance(e, Openings) for e in scene.effects].index(True)
    within = jnp.abs(scene.state.position[:, 0] - 1.0) < 0.5

    def mean(peak):
        ends = scene.effects[number]
        inlet = dataclasses.replace(
            ends.openings[0], velocity=dataclasses.replace(ends.openings[0].velocity, peak=peak)
        )
        changed = dataclasses.replace(ends, openings=(inlet, *ends.openings[1:]))
        now = model.with_effect(changed)
        state, fault, _, _ = integrate(
            now, scene.state, jnp.asarray(0), jnp.asarray(schedule.time_step), schedule.steps, 1
        )
        weight = jnp.where(within, state.density, 0.0)
        found = jnp.sum(weight * state.velocity[:, 0]) / jnp.sum(weight)
        return jnp.where(fault.code == int(FaultCode.NONE), found, jnp.nan)

    here, step = jnp.asarray(1.0), 1e-4
    _, forward = jax.jit(lambda x: jax.jvp(mean, (x,), (jnp.ones_like(x),)))(here)
    reverse = jax.jit(jax.grad(mean))(here)
    both = jax.jit(jax.vmap(mean))(jnp.asarray([1.0 - step, 1.0 + step]))  # a sweep, too
    assert float(forward) != 0.0
    assert float(reverse) == pytest.approx(float(forward), rel=1e-9)
    assert float(both[1] - both[0]) / (2.0 * step) == pytest.approx(float(forward), rel=1e-5)


def short_reserve():
    scene = stream()
    *others, ends = scene.effects
    inlet = dataclasses.replace(ends.openings[0], reserve=0.1)
    ends = dataclasses.replace(ends, openings=(inlet, *ends.openings[1:]))
    return dataclasses.replace(scene, effects=(*others, ends))


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: an_opening(inward=0.5), "inward is 1.0 or -1.0, got 0.5"),
        (lambda: an_opening(cell=0.0), "cells must be wider than zero"),
        (lambda: dataclasses.replace(an_opening(), axis=2), "axis 2 in 2 dimensions"),
        (short_reserve, "a reserve of 0.1 m is shorter than the kernel's support of 0.375 m"),
        (lambda: an_opening(reserve=1.0), "a reserve of 1 m in a buffer of 1 m"),
        (lambda: an_opening(pressure=jnp.zeros(())), "a pressure and its rate belong together"),
        (lambda: OpenEnds(spare=-0.1), "spare: a share of at least 0, got -0.1"),
        (lambda: Parking(Box.unit_periodic(2)), "periodic along axis 0, and has no outside"),
        (lambda: poiseuille_open(12, ends="valve"), "ends: one of fringe, openings, got 'valve'"),
    ],
)
def test_bad_openings_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_an_inlet_has_particles_to_let_in_and_an_outlet_may_be_dry(plug):
    """A start with the buffer of one of two openings empty."""
    scene, _ = plug
    effect = openings_of(scene)
    of_inlet, of_outlet = (o.in_buffer(scene.state.position)[:, None] for o in effect.openings)
    assert effect.openings[0].velocity is not None and of_inlet.any() and of_outlet.any()

    def without(there):
        position = jnp.where(there, jnp.asarray(scene.parking.place), scene.state.position)
        return effect.step_limit_from(position, scene.fluid, scene.space)

    assert without(of_outlet) == np.inf
    with pytest.raises(ValueError, match="no particle is in the buffer of the inlet"):
        without(of_inlet)


def test_scenes_without_openings_know_nothing_of_them():
    scene = poiseuille_open(12, end_time=0.1)
    assert scene.parking is None
    assert scene.model().observe(scene.state).active is None


def test_what_is_parked_is_in_no_figure(tmp_path):
    """Errors beside the exact flow, mass of a restart, files of all kinds, pictures."""
    scene = poiseuille_open(8, ends="openings", h_over_dx=1.5, end_time=0.1)
    assert float(scene.mass) == pytest.approx(scene.space.cell_volume, rel=1e-12)  # rho0 = 1
    flow = run_scene(scene)
    later = dataclasses.replace(scene, state=flow.state(-1))
    assert float(later.mass) == float(scene.mass)
    there = flow.active[-1]
    exact, _ = scene.exact(flow.position[-1], 0.0)
    known = dataclasses.replace(flow, velocity=np.where(there[:, None], exact, 0.0)[None])
    known = dataclasses.replace(known, time=flow.time[-1:], position=flow.position[-1:])
    known = dataclasses.replace(known, active=flow.active[-1:])
    known = dataclasses.replace(known, density=flow.density[-1:], pressure=flow.pressure[-1:])
    assert _errors(scene, known)["velocity_relative_l2"] == 0.0
    saved = read_trajectory(flow.save(tmp_path / "saved.h5"))
    np.testing.assert_array_equal(saved.active, flow.active)
    history = read_history(tmp_path / "saved.h5", flow.particles, float(scene.mass))
    np.testing.assert_array_equal(
        history.highest_density, np.where(flow.active, flow.density, 0.0).max(axis=1)
    )
    figure = flow.plot()
    assert figure.axes[0].get_xlim()[0] > scene.space.box.lower[0] - 0.2
    swept = tmp_path / "sweep.h5"
    sweep([scene, scene], swept)
    np.testing.assert_array_equal(read_member(swept, 1).active, flow.active)
    with pytest.raises(ValueError, match="scene: particles come in and go out of it"):
        continued(scene, flow.state(-1), scene.space)
    with pytest.raises(ValueError, match="scene: particles come in and go out of"):
        check_still(scene)
    with pytest.raises(ValueError, match="list all openings in one Openings"):
        dataclasses.replace(scene, effects=(*scene.effects, scene.effects[-1]))
