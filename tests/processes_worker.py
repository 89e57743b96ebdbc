"""One of two processes that run simulations together, each with two devices of four.

    python processes_worker.py ADDRESS NUMBER SCENE FILE
"""

import dataclasses
import sys

import jax

if __name__ == "__main__":
    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_num_cpu_devices", 2)
    jax.config.update("jax_cpu_collectives_implementation", "gloo")
    jax.distributed.initialize(sys.argv[1], 2, int(sys.argv[2]))

import equinox as eqx

import jaxsph
from jaxsph.arrangements import JitteredLattice
from jaxsph.io import TrajectoryFileError, TrajectoryWriter
from jaxsph.scenes import lid_driven_cavity, taylor_green

SCENES = {
    "vortex": lambda: taylor_green(32, h_over_dx=1.3, arrangement=JitteredLattice()),
    "cavity": lambda: lid_driven_cavity(31, h_over_dx=1.3),
}


def short(name):
    scene = SCENES[name]()
    return dataclasses.replace(scene, end_time=6 * scene.time_step, steps_per_snapshot=3)


def fault(scene, devices=None):
    """What is said of a run in which one particle is far too fast."""
    thrown = scene.state.velocity.at[77].set(1e4)
    state = eqx.tree_at(lambda s: s.velocity, scene.state, thrown)
    schedule = jaxsph.Schedule(scene.time_step, 2, 1)
    try:
        jaxsph.simulate(scene.model(), state, schedule, devices=devices)
    except jaxsph.SimulationError as error:
        return str(error)


def refused(scene, path, devices):
    """What is said where the file cannot be written, by either process."""
    try:
        jaxsph.run_scene(scene, path, devices=devices)
    except ValueError as error:
        return str(error)


def no_room(scene, path, devices):
    """What is said where the disk takes no more after the first snapshot; one process has it."""
    append = TrajectoryWriter.append

    def full(writer, step, *others):
        if step:
            raise TrajectoryFileError(f"{path}: no room at step {step}.")
        append(writer, step, *others)

    TrajectoryWriter.append = full
    return refused(scene, path, devices)


if __name__ == "__main__":
    scene, devices = short(sys.argv[3]), jaxsph.Devices(jax.devices())
    assert (devices.count, devices.processes) == (4, 2)
    assert len(jaxsph.run_scene(scene, sys.argv[4], devices=devices).time) == 3
    print(fault(scene, devices))
    print(refused(scene, sys.argv[4] + "/beside.h5", devices))
    print(no_room(scene, sys.argv[4] + ".full", devices))
