"""Reduced models' matrix products keep their factors' precision on a GPU."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxsph.arrangements import Lattice
from jaxsph.scenes import taylor_green
from jaxsph_rom import AdjointPetrovGalerkin
from jaxsph_rom.points.prediction.sweep import batch_of
from jaxsph_rom.points.prediction.times import EvenTimes
from tests.rom.points.prediction.test_sweep import MODES, STEPS, make_flow
from tests.rom.test_model import reduced
from tests.test_compiled import assert_full


def test_members_of_a_tensor_model_are_in_full_precision():
    flow, times = make_flow(), EvenTimes.of(STEPS, jnp.float64)

    def members(starts, values):
        return batch_of(flow.system, flow.bound, times, starts, values)

    assert_full(members, jnp.ones((7, MODES)), jnp.full(7, 0.01))


def test_a_model_on_particles_and_its_derivative_are_in_full_precision():
    scene = taylor_green(12, arrangement=Lattice())
    modes = np.random.default_rng(0).normal(size=(144, 3, 2))
    model = reduced(scene, modes, AdjointPetrovGalerkin(jnp.asarray(0.01)))
    lists = jax.eval_shape(lambda: model.prepare(model.project(scene.state)))

    def total(state, lists):
        coordinates = model.project(state)
        rates = model.rates(jnp.zeros(()), coordinates, lists)
        return jnp.sum(rates.coordinates) + jnp.sum(model.reconstruct(coordinates).density)

    assert_full(jax.grad(total), scene.state, lists)
