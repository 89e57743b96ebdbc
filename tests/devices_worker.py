"""Checks of `test_devices.py`, run by a process that has eight devices.

    python devices_worker.py CHECK SCENE [ARGUMENT]
"""

import contextlib
import dataclasses
import json
import math
import sys
import warnings
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import jaxsph
from benchmarks.devices import collectives, exchanged, text_of
from jaxsph.arrangements import JitteredLattice
from jaxsph.compiled import compiled
from jaxsph.exchange import Gathered, Halo
from jaxsph.integrate import AutomaticSteps, integrate
from jaxsph.scenes import (
    dam_break,
    lid_driven_cavity,
    piston_wave_maker,
    poiseuille_open,
    taylor_green,
    taylor_green_3d,
)

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_dtype_promotion", "strict")
jax.config.update("jax_numpy_rank_promotion", "raise")

SCENES = {
    "vortex": lambda: taylor_green(31, h_over_dx=2.0, arrangement=JitteredLattice()),
    "cavity": lambda: lid_driven_cavity(31, h_over_dx=1.3),
    "dam break": lambda: dam_break(64),
    "vortex in 3D": lambda: taylor_green_3d(16, h_over_dx=1.0, arrangement=JitteredLattice()),
    "piston": lambda: piston_wave_maker(64),
    "even vortex": lambda: taylor_green(32, h_over_dx=1.3, arrangement=JitteredLattice()),
    "even cavity": lambda: lid_driven_cavity(32, h_over_dx=1.3),
    "openings": lambda: poiseuille_open(12, ends="openings", h_over_dx=1.5, end_time=1.0),
    # too small for halos
    "small vortex": lambda: taylor_green(18, arrangement=JitteredLattice()),
    "small cavity": lambda: lid_driven_cavity(18),
}
DEVICES = jaxsph.Devices(jax.devices())
FIELDS = ("position", "velocity", "density")


def relative(one, other):
    """Largest difference over the largest value."""
    one, other = np.asarray(one), np.asarray(other)
    return float(np.max(np.abs(one - other)) / (np.max(np.abs(one)) or 1.0))


def apart(one, other):
    return {name: relative(getattr(one, name), getattr(other, name)) for name in FIELDS}


def exchange(scene):
    """Of which kind, and how deep beside a device's share."""
    count = len(scene.state.density)
    search = scene.model().over(DEVICES).search
    found = getattr(search, "fluid", search).exchange(count)
    return {"kind": type(found).__name__, "sent": found.sent(count), "share": DEVICES.share(count)}


def window(scene):
    """Of a table whose rows are numbers: those that a device sees, at places that it is told."""
    rows, wrong = 5 * DEVICES.count, 0
    number = jnp.arange(rows, dtype=jnp.int32)
    for way in (Gathered(DEVICES), *(Halo(DEVICES, depth) for depth in (1, 4, 5, 7, 10, 17))):
        def shown(table, way=way):
            ring = (number + 5 * DEVICES.number()) % rows  # from its first row on
            place, seen = way.seen(number, rows)
            read = way.window(table)[0].at[place].get(mode="clip")
            same = (way.among_all(place, rows) == number) & (read == ring)
            return jnp.stack([jnp.sum(seen & ~same), jnp.sum(seen) - 5 - way.sent(rows)])[None]

        wrong += int(jnp.sum(jnp.abs(DEVICES.each(shown, (1,), 0)(number[None]))))
    return {"wrong": wrong}


def run(scene, steps):
    schedule = jaxsph.Schedule(scene.time_step, int(steps), 1)
    one, many = (
        jaxsph.simulate(scene.model(), scene.state, schedule, devices=devices)
        for devices in (None, jax.devices())
    )
    way = scene.space.box.displacement(jnp.asarray(one.position[0]), jnp.asarray(one.position[-1]))
    way = float(jnp.max(jnp.abs(way)) / (0.5 * scene.model().search.skin))
    return {**apart(one, many), "way_over_half_skin": way}


def order(scene, steps):
    """The same particles in other orders, on one device: the most that three of them differ by."""
    schedule = jaxsph.Schedule(scene.time_step, int(steps), 1)

    def end(state):
        return jaxsph.simulate(scene.model(), state, schedule).state(-1)

    one, found = end(scene.state), []
    for seed in range(3):
        places = np.random.default_rng(seed).permutation(len(scene.state.density))
        other = end(jax.tree.map(lambda a, places=places: a[places], scene.state))
        found.append(apart(one, jax.tree.map(lambda a, p=places: a[np.argsort(p)], other)))
    return {name: max(each[name] for each in found) for name in FIELDS}


def gradient(scene):
    @compiled
    def slope(model, state):
        def energy(state):
            dt = jnp.asarray(scene.time_step)
            end, *_ = integrate(model, state, jnp.asarray(0), dt, 4, 1)
            return jnp.sum(end.velocity**2) + jnp.sum((end.density / 1000.0 - 1.0) ** 2)

        return jax.grad(energy)(state)

    model = scene.model()
    return apart(slope(model, scene.state), slope(model.over(DEVICES), scene.state))


def forces(scene):
    on_walls = jaxsph.WallForces.of(scene)
    schedule = jaxsph.Schedule(scene.time_step, 4, 2)
    one, many = (
        jaxsph.simulate(
            scene.model(), scene.state, schedule, stepping=AutomaticSteps(), measure=on_walls,
            averaged=on_walls, devices=devices,
        )
        for devices in (None, jax.devices())
    )  # fmt: skip
    loads = ("forces", "torques", "mean_forces", "mean_torques")
    found = {name: relative(getattr(one, name)["walls"], getattr(many, name)["walls"])
             for name in loads}  # fmt: skip
    return {**found, **apart(one, many)}


def ways(scene):
    """Of the rates of moving particles: forward mode, members side by side, and called as they
    are."""
    model, zero, found = scene.model(), jnp.zeros(()), {}
    moving = 0.1 * jnp.sin(7.0 * scene.state.position[:, ::-1])
    state = eqx.tree_at(lambda s: s.velocity, scene.state, moving)

    def both(name, function):
        one, many = function(model), function(model.over(DEVICES))
        found.update({f"{name} {key}": value for key, value in apart(one, many).items()})

    def rates(model, state):
        return model.rates(zero, state, model.prepare(state))

    def tangent(model, state):
        return jax.jvp(lambda s: rates(model, s), (state,), (state,))[1]

    members = jax.tree.map(lambda a: jnp.stack([a, 1.0001 * a]), state)
    both("forward", lambda model: eqx.filter_jit(tangent)(model, state))
    both("members", lambda model: eqx.filter_jit(
        lambda m, s: jax.vmap(lambda s: rates(m, s))(s))(model, members))  # fmt: skip
    both("eager", lambda model: rates(model, state))

    def in_place(model, state):  # as steps keep particles
        state, neighbors = model.begin(state)
        return model.end(model.rates(zero, state, neighbors), neighbors)

    both("in place", lambda model: eqx.filter_jit(in_place)(model, state))
    near, list_of_one = (
        m.prepare(state).closest(scene.space.box, state.position)
        for m in (model.over(DEVICES), model)
    )
    found["closest"] = abs(float(near[0] - list_of_one[0])) + float(near[1] != list_of_one[1])
    return found


def faults(scene, limit):
    """A list or a halo too small is made larger; a particle thrown out is the one of one device."""
    model = scene.model()
    fluid = model.search.fluid
    room = {"capacity": fluid.capacity // 2} if limit == "list" else {"depths": (60, 60)}
    tight = eqx.tree_at(lambda m: m.search, model, dataclasses.replace(
        model.search, fluid=dataclasses.replace(fluid, **room)
    ))  # fmt: skip
    schedule = jaxsph.Schedule(scene.time_step, 2, 1)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        run = jaxsph.simulate(tight, scene.state, schedule, devices=jax.devices())
    whole = jaxsph.simulate(model, scene.state, schedule)
    grown = any("more neighbours than the list holds" in str(w.message) for w in told)
    grown = grown and max(apart(run, whole).values()) < 1e-13
    state = eqx.tree_at(lambda s: s.velocity, scene.state, scene.state.velocity.at[77].set(1e4))
    messages = []
    for devices in (None, jax.devices()):
        try:
            jaxsph.simulate(model, state, schedule, devices=devices)
        except jaxsph.SimulationError as error:
            messages.append(str(error))
    return {"enlarged": grown, "same": len(messages) == 2 and messages[0] == messages[1]}


def resume(scene, folder):
    """Two intervals by eight devices and two by four, in a file; and all by one."""
    scene = dataclasses.replace(scene, end_time=8 * scene.time_step, steps_per_snapshot=2)
    path = Path(folder, "run.h5")

    class Cut(Exception):
        pass

    def cut(steps):
        if read_steps(path) >= 4:
            raise Cut

    with contextlib.suppress(Cut):
        jaxsph.run_scene(scene, path, progress=cut, devices=jax.devices())
    assert read_steps(path) == 4
    whole = jaxsph.run_scene(scene, path, devices=jax.devices()[:4])
    assert len(whole.time) == 5
    return apart(jaxsph.run_scene(scene), whole)


def read_steps(path):
    return jaxsph.io.read_overview(path).step


def traffic(scene):
    model, state = scene.model().over(DEVICES), DEVICES.placed(scene.state)
    neighbors = eqx.filter_jit(model.prepare)(state)
    zero, index = jnp.zeros(()), neighbors.fluid.index
    sent = exchanged(text_of(model.rates, zero, state, neighbors))
    share = index.addressable_shards[0].data.nbytes / index.nbytes
    return {"share_of_list": share, **{kind: n / len(state.density) for kind, n in sent.items()}}


def halos(scene):
    """What devices tell one another of particles that lie in place, for a right-hand side and for
    its gradient: columns of halos, and how many other arrays have a row for each particle."""
    model, state = scene.model().over(DEVICES), DEVICES.placed(scene.state)
    state, neighbors = eqx.filter_jit(model.begin)(state)
    zero, depth = jnp.zeros(()), neighbors.exchange.depth

    def slope(model, state, neighbors):
        return jax.grad(lambda s: jnp.sum(model.rates(zero, s, neighbors).velocity ** 2))(state)

    rates = columns_and_others(text_of(model.rates, zero, state, neighbors), depth)
    gradient = columns_and_others(text_of(slope, model, state, neighbors), depth)
    rows = len(state.density)
    whole = [sides for _, others in (rates, gradient) for sides in others if rows in sides]
    return {"columns": rates[0], "columns_of_gradient": gradient[0], "whole": len(whole)}


def run_halos(scene):
    """The same of a run of several steps, its lists included; and numbers of other arrays."""
    model, state = scene.model().over(DEVICES), DEVICES.placed(scene.state)

    def run(model, state):
        return integrate(model, state, jnp.asarray(0), jnp.asarray(scene.time_step), 3, 1)[0]

    count = len(state.density)
    depth = model.search.exchange(count).depth
    columns, others = columns_and_others(text_of(run, model, state), depth)
    return {"columns": columns, "others": sum(map(math.prod, others)) / count}


def columns_and_others(text, depth):
    sent = collectives(text)
    halos = sum(math.prod(sides) for by, _, sides in sent if by == "collective-permute")
    return halos / (2 * depth), [sides for by, _, sides in sent if by != "collective-permute"]


if __name__ == "__main__":
    check, scene, *rest = sys.argv[1:]
    print(json.dumps(globals()[check](SCENES[scene](), *rest)))
