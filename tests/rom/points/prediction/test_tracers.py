"""Tracers in a reduced flow follow its streamlines and stay inside walls."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import Box, Fluid, Space
from jaxsph.arrangements import Lattice
from jaxsph.integrate import FaultCode, integrate
from jaxsph.interpolation import ShepardMap
from jaxsph.kernels import WendlandC2
from jaxsph.walls import BoxRegion, Walls
from jaxsph_rom import Basis, ReferenceSpace
from jaxsph_rom.points import QuadraticSystem, ReducedFlow, TracerModel, TracerState

SPEED = 0.5


def swirl(x):
    """A steady cell with the stream function sin(2 pi x) sin(2 pi y) / (2 pi)."""
    x, y = 2 * np.pi * x[:, 0], 2 * np.pi * x[:, 1]
    return np.stack([np.sin(x) * np.cos(y), -np.cos(x) * np.sin(y)], axis=1)


def steady_flow(velocity, periodic=True, off_lattice=0.0):
    """One mode that neither grows nor decays, on 24 x 24 points."""
    space = Space(Box((0.0, 0.0), (1.0, 1.0), (periodic, periodic)), WendlandC2(), 1 / 12, 1 / 24)
    points = Lattice().positions(space) + off_lattice
    fields = np.concatenate([np.zeros((len(points), 1)), velocity(np.asarray(points))], axis=1)
    basis = Basis(fields[..., None], np.array([[1.0, 0.0, 0.0]]), np.ones(3), np.ones(1))
    system = QuadraticSystem(jnp.zeros((2, 1)), jnp.zeros((2, 1, 1)), jnp.zeros((1, 1, 1)))
    fluid = Fluid(*map(jnp.asarray, (1.0, 10.0, 1.0)))
    return ReducedFlow(ReferenceSpace(points, space, ShepardMap), basis, system, fluid)


@eqx.filter_jit
def run(model, position, steps, time_step):
    start = TracerState(jnp.asarray([SPEED]), position)
    return integrate(model, start, 0, jnp.asarray(time_step), steps, 1)


def test_tracers_stay_on_their_streamlines():
    model = TracerModel.of(steady_flow(swirl), jnp.asarray(0.01))
    position = jnp.asarray(np.random.default_rng(0).uniform(0.05, 0.45, (20, 2)))

    def stream(x):
        return np.sin(2 * np.pi * np.asarray(x[:, 0])) * np.sin(2 * np.pi * np.asarray(x[:, 1]))

    end, fault, seen, _ = run(model, position, 40, 0.02)
    assert int(fault.code) == 0
    assert np.abs(np.asarray(end.position - position)).max() > 0.2  # they have gone round
    np.testing.assert_allclose(stream(end.position), stream(position), atol=5e-3)  # of 1: cubics
    exact = SPEED * swirl(np.asarray(end.position))
    np.testing.assert_allclose(seen.velocity[0], exact, atol=2e-3)  # cubics, 1/24
    np.testing.assert_allclose(seen.density, 1.0, rtol=1e-12)
    np.testing.assert_array_equal(seen.coordinates[0], [SPEED])


def test_a_centre_that_moves_carries_them_too():
    flow = steady_flow(lambda x: np.ones_like(x))
    flow = eqx.tree_at(lambda f: f.basis.centre, flow, np.array([[1.0, -SPEED, 0.0]]))
    model = TracerModel.of(flow, jnp.asarray(0.01))
    position = jnp.asarray([[0.2, 0.9], [0.7, 0.4]])
    end, fault, _, _ = run(model, position, 10, 0.04)
    assert int(fault.code) == 0
    wanted = (np.asarray(position) + [0.0, 0.2]) % 1.0  # u = (1, 1) / 2 - (1, 0) / 2
    np.testing.assert_allclose(end.position, wanted, atol=1e-10)


def test_walls_keep_them():
    flow = steady_flow(lambda x: np.tile([1.0, 0.0], (len(x), 1)), periodic=False)
    walls = Walls.around(BoxRegion((0.0, 0.0), (1.0, 1.0)), flow.reference.space, (), None)
    position = jnp.asarray([[0.9, 0.5], [0.3, 0.5]])
    end, fault, _, _ = run(TracerModel.of(flow, jnp.asarray(0.01), walls), position, 20, 0.02)
    assert int(fault.code) == 0
    np.testing.assert_allclose(end.position[1], [0.5, 0.5], atol=1e-6)
    assert 0.98 < float(end.position[0, 0]) < 1.0  # a quarter of a spacing from the wall


def test_crowds_are_named_where_splines_carry_them():
    crowd = jnp.full((200, 2), 0.5)
    for off_lattice, wanted in ((0.0, FaultCode.NONE), (1e-3, FaultCode.SPLINE_CELL_OVERFLOW)):
        flow = steady_flow(swirl, off_lattice=off_lattice)
        assert int(run(TracerModel.of(flow, jnp.asarray(0.01)), crowd, 1, 0.02)[1].code) == wanted


@pytest.mark.parametrize("share", [0.3, 1.0])
def test_a_flow_that_is_lost_takes_its_tracers_along(share):
    model = TracerModel.of(steady_flow(swirl), jnp.asarray(0.01))
    model = eqx.tree_at(lambda m: m.flow.bound.limit, model, jnp.asarray(share * SPEED**2 / 2))
    position = jnp.asarray([[0.3, 0.3]])
    end, fault, _, good = jax.block_until_ready(run(model, position, 2, 0.02))
    lost = share < 1.0  # mean |u|^2 is a half of SPEED^2, and at the limit itself all is well
    model = eqx.tree_at(lambda m: m.flow.bound.limit, model, 1.01 * model.flow.bound.limit)
    assert (int(run(model, position, 2, 0.02)[1].code) == FaultCode.ENERGY_OUT_OF_BOUNDS) == lost
    if lost:
        assert int(fault.code) == FaultCode.ENERGY_OUT_OF_BOUNDS and not good.any()
        np.testing.assert_array_equal(end.position, position)
