"""From full runs to a reduced flow on reference points and back to fields."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import Schedule, SimulationError, run_scene
from jaxsph.arrangements import Lattice, Stirred
from jaxsph.scenes import taylor_green
from jaxsph_rom import Euclidean, MeanCentred, block_pod
from jaxsph_rom.points import QuadraticSystem, ReducedFlow, mapped_run


@pytest.fixture(scope="module")
def flow_and_run():
    scene = taylor_green(24, 100.0, arrangement=Stirred(), end_time=0.1)
    run = run_scene(scene)
    flow = ReducedFlow.train(scene, [run], Lattice().positions(scene.space), modes=4)
    return flow, run, scene


def test_coordinates_and_fields_go_there_and_back(flow_and_run):
    flow, run, scene = flow_and_run
    mapped = mapped_run(flow.reference, run, scene.fluid)
    coordinates = flow.project(mapped)
    assert coordinates.shape == (len(run.time), 4)
    fields = flow.fields(coordinates, run.time)
    again = flow.project(mapped_run_of(fields, flow, scene))
    np.testing.assert_allclose(again, coordinates, rtol=0, atol=1e-10)
    # four modes hold the vortex but for noise: velocity within half a percent
    velocity = np.moveaxis(mapped[:, 1:], -1, 0)
    assert np.abs(fields.velocity - velocity).max() < 0.005
    np.testing.assert_array_equal(fields.position[3], flow.reference.points)


def test_fields_at_other_points_are_exact_at_the_reference_points(flow_and_run):
    flow, run, _ = flow_and_run
    coordinates = jnp.asarray(np.random.default_rng(0).normal(size=(2, 4)) * 0.01)
    everywhere = flow.fields(coordinates, np.arange(2.0))
    some = np.asarray(flow.reference.points)[5:90:7]
    found = flow.fields(coordinates, np.arange(2.0), some)
    np.testing.assert_allclose(found.velocity, everywhere.velocity[:, 5:90:7], atol=1e-9)
    np.testing.assert_allclose(found.density, everywhere.density[:, 5:90:7], atol=1e-7)
    crowd = np.full((500, 2), 0.5)
    together = flow.fields(coordinates, np.arange(2.0), crowd).velocity
    alone = flow.fields(coordinates, np.arange(2.0), crowd[:1]).velocity
    wanted = np.broadcast_to(alone, together.shape)
    np.testing.assert_allclose(together, wanted, rtol=1e-14)  # of two programs
    by_splines = eqx.tree_at(lambda f: f.reference.points, flow, flow.reference.points + 1e-3)
    with pytest.raises(ValueError, match="too many in one cell"):
        by_splines.fields(coordinates, np.arange(2.0), crowd)


@pytest.mark.parametrize(
    "settings",
    [
        {"modes": 4, "centring": MeanCentred()},
        {"modes": (2, 3), "decompose": block_pod},
        {"modes": 5, "decompose": block_pod, "centring": MeanCentred(), "product": Euclidean()},
    ],
)
def test_any_centre_and_any_decomposition(flow_and_run, settings):
    _, run, scene = flow_and_run
    points = Lattice().positions(scene.space)
    flow = ReducedFlow.train(scene, [run], points, **settings)
    mapped = mapped_run(flow.reference, run, scene.fluid)
    coordinates = flow.project(mapped)
    fields = flow.fields(coordinates, run.time)
    np.testing.assert_allclose(
        flow.project(mapped_run_of(fields, flow, scene)), coordinates, rtol=0, atol=1e-9
    )
    found = flow.fields(coordinates[:2], run.time[:2], np.asarray(points)[5:90:7])
    np.testing.assert_allclose(found.velocity, fields.velocity[:2, 5:90:7], atol=1e-9)
    np.testing.assert_allclose(found.density, fields.density[:2, 5:90:7], atol=1e-7)
    after = flow.fields(flow.predict(coordinates[0], 0.01, scene.schedule), run.time[1:])
    # the run that it knows, within a percent of the largest speed
    assert np.abs(after.velocity - np.moveaxis(mapped[:, 1:, 1:], -1, 0)).max() < 0.01


def mapped_run_of(fields, flow, scene):
    """(r, u) of fields that are on the reference points already."""
    rest = float(scene.fluid.reference_density)
    log_density = rest * (1.0 + np.log(fields.density / rest))
    stacked = np.concatenate([log_density[..., None], fields.velocity], axis=2)
    return np.moveaxis(stacked, 0, -1)


def test_it_predicts_the_run_that_it_knows(flow_and_run):
    flow, run, scene = flow_and_run
    coordinates = flow.project(mapped_run(flow.reference, run, scene.fluid))
    found = flow.predict(coordinates[0], 0.01, scene.schedule)
    np.testing.assert_allclose(found[:, 0], coordinates[1:, 0], rtol=0.005)


def test_fewer_modes_of_a_trained_flow(flow_and_run):
    flow, _, _ = flow_and_run
    part = flow.truncated(2)
    assert part.system.size == part.basis.size == 2
    with pytest.raises(ValueError, match="5 asked for"):
        flow.truncated(5)


def test_a_flow_that_grows_beyond_all_bounds_is_named(flow_and_run):
    flow, _, _ = flow_and_run
    wild = QuadraticSystem(jnp.zeros((2, 1)), jnp.zeros((2, 1, 1)), jnp.full((1, 1, 1), 50.0))
    wild = ReducedFlow(flow.reference, flow.basis.truncated(1), wild, flow.fluid)
    with pytest.raises(SimulationError, match="step"):  # da/dt = 50 a^2 is infinite at t = 0.02
        wild.predict(jnp.ones(1), 0.01, Schedule(1e-3, 5, 10))
