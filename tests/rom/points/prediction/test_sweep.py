"""Many Reynolds numbers at once: member by member what single runs give."""

from importlib import import_module
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import Box, Fluid, Schedule, SimulationError, Space
from jaxsph.arrangements import Lattice
from jaxsph.integrate import FaultCode
from jaxsph.interpolation import ShepardMap
from jaxsph.kernels import WendlandC2
from jaxsph_rom import Basis, ReferenceSpace
from jaxsph_rom.points import (
    EnergyBound,
    QuadraticSystem,
    ReducedFlow,
    sweep,
)

prediction_sweep = import_module("jaxsph_rom.points.prediction.sweep")  # not the function
MODES = 3
STEPS = Schedule(time_step=0.01, steps_per_snapshot=2, intervals=20)


def make_flow(growth=0.0):
    """An oscillation, a decay by viscosity, and a mode that grows if it starts above zero."""
    space = Space(Box.unit_periodic(2), WendlandC2(), 0.25, 0.125)
    points = Lattice().positions(space)
    rng = np.random.default_rng(0)
    flat, _ = np.linalg.qr(rng.normal(size=(3 * len(points), MODES)))
    modes = flat.reshape(len(points), 3, MODES)
    modes[:, 0] /= 10.0  # weight (c0 / rho0)^2 = 100
    basis = Basis(modes, np.array([[1.0, 0.0, 0.0]]), np.array([100.0, 1.0, 1.0]), np.ones(5))
    linear = np.zeros((2, MODES, MODES))
    linear[0, 0, 1], linear[0, 1, 0] = 3.0, -3.0
    linear[1] = -20.0 * np.eye(MODES)
    quadratic = np.zeros((MODES, MODES, MODES))
    quadratic[0, 1, 1], quadratic[1, 0, 1], quadratic[1, 1, 0] = 0.4, -0.2, -0.2
    quadratic[2, 2, 2] = growth
    system = QuadraticSystem(jnp.zeros((2, MODES)), jnp.asarray(linear), jnp.asarray(quadratic))
    fluid = Fluid(*map(jnp.asarray, (1.0, 10.0, 1.0)))
    return ReducedFlow(ReferenceSpace(points, space, ShepardMap), basis, system, fluid)


def test_members_are_one_product_with_a_matrix_that_they_share():
    flow, members = make_flow(), 64
    times = prediction_sweep.EvenTimes.of(STEPS, np.dtype(float))
    arguments = jnp.zeros((members, MODES)), jnp.full((members, 1), 0.01)
    lowered = prediction_sweep.batch_of.lower(flow.system, flow.bound, times, *arguments)
    products = [line for line in lowered.as_text().splitlines() if "dot_general" in line]
    assert any(f"-> tensor<{MODES}x{members}xf64>" in line for line in products)
    assert not any(f"<{members}x{MODES}x{MODES}" in line for line in products)


@pytest.mark.parametrize("batch", [3, 7, 100])
def test_members_are_single_runs(batch):
    flow = make_flow()
    rng = np.random.default_rng(1)
    starts, viscosities = rng.normal(size=(7, MODES)), rng.uniform(0.005, 0.02, 7)
    done = []
    found = sweep(flow, starts, viscosities, STEPS, batch=batch, progress=done.append)
    assert sum(done) == 7 and (found.code == 0).all() and (found.step == -1).all()
    for k in range(7):
        alone = flow.predict(jnp.asarray(starts[k]), viscosities[k], STEPS)
        np.testing.assert_allclose(found.coordinates[k], alone, rtol=0, atol=1e-14)
    assert found.run_seconds > 0


def test_one_that_blows_up_takes_no_other_along():
    flow = make_flow(growth=50.0)
    starts = np.array([[1.0, 0.5, 0.0], [1.0, 0.5, 1.0], [1.0, 0.5, 0.1]])
    found = sweep(flow, starts, np.full(3, 0.01), STEPS)
    lost = FaultCode.ENERGY_OUT_OF_BOUNDS
    assert found.code.tolist() == [0, lost, lost]
    assert np.isfinite(found.coordinates[0]).all()
    with pytest.raises(SimulationError, match="more energy") as caught:
        flow.predict(jnp.asarray(starts[1]), 0.01, STEPS)
    assert caught.value.step == found.step[1]
    # da/dt = 50 a^2 - 0.2 a is infinite soon after t = 1 / (50 a)
    assert 1 <= found.step[1] <= 5 < found.step[2]
    lost = np.isnan(found.coordinates[2]).all(axis=1)
    assert not lost[: (found.step[2] - 1) // 2].any() and lost[-1]


def test_energy_is_that_of_the_fields():
    flow = make_flow()
    rng = np.random.default_rng(2)
    basis = Basis(flow.basis.modes, np.array([[0.9, 0.2, -0.1]]), np.ones(3), np.ones(5))
    bound = EnergyBound.of(basis, flow.fluid)
    a = rng.normal(size=MODES)
    fields = basis.centre + basis.modes @ a
    energy = np.mean(np.sum(fields[:, 1:] ** 2, axis=1) + 100.0 * (fields[:, 0] - 1.0) ** 2)
    assert float(bound.energy(jnp.asarray(a))) == pytest.approx(energy, rel=1e-12)
    # in the energy product about rest it is |a|^2 over the number of points
    assert float(flow.bound.energy(jnp.asarray(a))) == pytest.approx(a @ a / 64, rel=1e-12)
    assert not flow.bound.exceeded(jnp.asarray([15.9, 0.0, 0.0]))  # (2 U)^2 at |a|^2 = 256
    assert flow.bound.exceeded(jnp.asarray([16.1, 0.0, 0.0]))


def test_without_members_there_is_no_sweep():
    with pytest.raises(ValueError, match="at least one"):
        sweep(make_flow(), np.zeros((0, MODES)), np.zeros(0), STEPS)


def test_a_batch_without_memory_is_refused(monkeypatch):
    """A device that is full, in place of one that runs."""
    full = SimpleNamespace(memory_stats=lambda: {"bytes_limit": 2**17, "bytes_in_use": 0})
    flow, starts = make_flow(), np.ones((400, MODES))
    asked = prediction_sweep._check_room
    monkeypatch.setattr(prediction_sweep, "_check_room", lambda a, _, batch: asked(a, full, batch))
    with pytest.raises(ValueError, match=r"batch: 400 members .* batch=\d+ should fit"):
        sweep(flow, starts, np.full(400, 0.01), STEPS)
