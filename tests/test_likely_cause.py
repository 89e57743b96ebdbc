"""A fault's message says what is likely, and where."""

import dataclasses
import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import Box, BoxRegion, Fluid, ParticleState, SimulationError, Space, Walls, run_scene
from jaxsph.arrangements import Lattice
from jaxsph.kernels import WendlandC2
from jaxsph.likely_cause import likely_cause
from jaxsph.scenes import lid_driven_cavity, taylor_green

DX, RHO0 = 0.1, 1000.0
FLUID = Fluid(RHO0, 10.0, 1.0)


def told(dim=2, moved=None, density=1.0, speed=0.0, time_step=1e-3, particle=None, walls=True):
    """What is said of the particle nearest to the middle, moved to a place."""
    box = Box((0.0,) * dim, (1.0,) * dim, (not walls,) * dim)
    space = Space(box, WendlandC2(), 2.0 * DX, DX)
    around = Walls.around(BoxRegion(box.lower, box.upper), space) if walls else None
    position = np.array(Lattice().positions(space))
    chosen = int(np.argmin(np.linalg.norm(position - 0.45, axis=1)))
    if moved is not None:
        position[chosen] = moved
    velocity, rho = np.zeros_like(position), np.full(len(position), RHO0)
    velocity[chosen, 0], rho[chosen] = speed, density * RHO0
    state = ParticleState(*(jnp.asarray(a) for a in (position, velocity, rho)))
    particle = chosen if particle is None else particle
    return likely_cause(state, particle, space, FLUID, around, time_step, 0.02)


@pytest.mark.parametrize(
    "options, message",
    [
        ({"time_step": 0.03}, "likely the step: 0.03 s is beyond 0.02 s"),
        ({"speed": 5.0}, r"likely a flow too fast.* 5 m/s, 50% of the sound speed"),
        ({"moved": (0.06, 0.95)}, r"likely a corner: .* across x and y .* nearest at 0.5"),
        ({"dim": 3, "moved": (0.5, 0.97, 0.03)}, "likely a corner: .* across y and z "),
        ({"dim": 3, "moved": (0.02, 0.9, 0.02)}, "likely a corner: .* across x and z "),
        ({"moved": (0.5, 0.99)}, r"likely a wall near a row: .*\(0.5, 0.99\) m is 0.1 spacings"),
        ({"moved": (0.35, 0.36)}, r"likely clumping: .* next neighbour 0.1 spacings away"),
        ({"walls": False, "moved": (0.96, 0.06)}, "likely clumping: .* 0.14 spacings"),
        ({"density": 0.9}, "likely tension: .* 0.9 times the reference density"),
    ],
)
def test_what_stands_out_is_named_with_its_place(options, message):
    assert re.search(message, told(**options))


def test_nothing_is_made_up_where_nothing_stands_out():
    assert told() is None
    assert told(density=1.1) is None
    assert told(particle=-1) is None


def fault_of(scene):
    with pytest.raises(SimulationError) as error:
        run_scene(scene)
    return str(error.value)


def test_a_run_that_is_lost_in_a_corner_says_so():
    scene = lid_driven_cavity(12, end_time=0.2)
    corner = int(jnp.argmax(jnp.sum(scene.state.position, axis=1)))
    density = scene.state.density.at[corner].multiply(1.19)
    state = dataclasses.replace(scene.state, density=density)
    velocity = state.velocity.at[corner].set(jnp.asarray([2.0, 2.0]))
    said = fault_of(dataclasses.replace(scene, state=dataclasses.replace(state, velocity=velocity)))
    assert re.search(rf"particle {corner}.*; likely a corner: ", said), said


def test_a_flow_faster_than_its_steps_says_so():
    scene = taylor_green(12, arrangement=Lattice())
    fast = dataclasses.replace(scene.state, velocity=40.0 * scene.state.velocity)
    said = fault_of(dataclasses.replace(scene, state=fast))
    assert "likely the step: " in said and "use a smaller time step" in said


def test_the_cause_is_told_in_single_precision():
    scene = taylor_green(12, arrangement=Lattice(), dtype=jnp.float32)
    fast = jax.tree.map(lambda u: 40.0 * u, scene.state.velocity)
    scene = dataclasses.replace(scene, state=dataclasses.replace(scene.state, velocity=fast))
    assert "likely the step: " in fault_of(scene)
