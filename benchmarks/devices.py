"""One simulation over several devices: what they tell one another, and how equal its results are.

    XLA_FLAGS=--xla_force_host_platform_device_count=8 python -m benchmarks.devices

Bytes are read in the compiled programs. The devices are parts of one CPU, so times are of a single
one, and those that its cores were busy.
Differences are those between eight devices and one after 200 steps, beside those between one device
and one device that has the same particles in another order.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import jaxsph
from jaxsph import Devices
from jaxsph.arrangements import JitteredLattice
from jaxsph.compiled import compiled
from jaxsph.environment import environment
from jaxsph.integrate import integrate
from jaxsph.neighbors.cell_runs import Sorted
from jaxsph.scenes import Scene, dam_break, lid_driven_cavity, taylor_green, taylor_green_3d

from .measure import alternate
from .table import Table, command

_DEVICES = 8
_STEPS = 200
_GRADIENT_STEPS = 6
_REPEATS = 5
_TRAFFIC = {  # sizes of which a device's share is large beside what is read around it
    "vortex": lambda: taylor_green(200, arrangement=JitteredLattice()),
    "vortex in 3D": lambda: taylor_green_3d(40, arrangement=JitteredLattice()),
    "cavity": lambda: lid_driven_cavity(100),
}
SMALL = {  # short supports, so that halos are less than all
    "vortex": lambda: taylor_green(31, h_over_dx=2.0, arrangement=JitteredLattice()),
    "cavity": lambda: lid_driven_cavity(31, h_over_dx=1.3),
    "dam break": lambda: dam_break(64),
    "vortex in 3D": lambda: taylor_green_3d(16, h_over_dx=1.0, arrangement=JitteredLattice()),
}
_COLLECTIVE = re.compile(
    r"= (.*?) (all-gather|all-reduce|collective-permute|all-to-all|reduce-scatter)(?:-start)?\("
)
_ARRAY = re.compile(r"\b(pred|[suf]\d+)\[([\d,]*)\]")


def main(argv: list[str] | None = None) -> int:
    """Count, compare and write; the exit code."""
    return command("devices", __doc__, lambda add: None, _run, argv)


def _run(options) -> None:
    devices = Devices.first(_DEVICES)
    settings = {"devices": _DEVICES, "steps": _STEPS, "gradient_steps": _GRADIENT_STEPS}
    table = Table(options.json, ("kind", "scene"), settings, lambda rows: environment())
    cases = ({"kind": kind, "scene": name} for kind in KINDS for name in KINDS[kind][1])
    for case in table.left(cases):
        measure, scenes = KINDS[case["kind"]]
        table.add(case | measure(scenes[case["scene"]](), devices))


def exchanged(text: str) -> dict[str, int]:
    """Bytes of each type that a compiled program's collectives leave on a device, loops counted
    once."""
    total: dict[str, int] = {}
    for _, kind, sides in collectives(text):
        bits = 8 if kind == "pred" else int(kind[1:])
        total[kind] = total.get(kind, 0) + bits // 8 * math.prod(sides)
    return total


def collectives(text: str) -> list[tuple[str, str, tuple[int, ...]]]:
    """Of a compiled program, each array that devices tell one another: by what, type and shape."""
    found = []
    for line in text.splitlines():
        by = _COLLECTIVE.search(line)
        for kind, sides in _ARRAY.findall(by[1]) if by else ():
            found.append((by[2], kind, tuple(int(side) for side in sides.split(",") if side)))
    return found


def text_of(function: Callable, *given: Any) -> str:
    """Of the compiled program."""
    return eqx.filter_jit(function).lower(*given).compile().compiled.as_text()


def traffic(scene: Scene, devices: Devices) -> Mapping[str, Any]:
    """What each device is sent for one right-hand side and for one list, in numbers a particle."""
    count, dtype = len(scene.state.density), scene.state.density.dtype
    zero, step = jnp.zeros((), dtype), jnp.asarray(scene.time_step, dtype)
    model, state, neighbors = _kept(scene, devices)
    exchange = neighbors.exchange
    rates = text_of(model.rates, zero, state, neighbors)
    halos = [math.prod(sides) for by, _, sides in collectives(rates) if by == "collective-permute"]
    renewed = text_of(model.keep_up, state, neighbors, step)
    gathering, *kept = _kept(scene, devices, halos=False)
    gathered = text_of(gathering.rates, zero, *kept)
    tables = (leaf for leaf in jax.tree.leaves(neighbors) if leaf.ndim == 2)
    lists = [leaf for leaf in tables if leaf.dtype == jnp.int32]
    held = sum(leaf.addressable_shards[0].data.nbytes for leaf in lists)
    alone, ready = scene.model(), eqx.filter_jit(scene.model().prepare)(scene.state)
    return {
        "particles": count,
        "rows_of_a_device": devices.share(count),
        "rows_of_a_halo": exchange.depth,
        "columns_of_halos": sum(halos) / (2 * exchange.depth),
        "numbers_in_halos": sum(halos) / count,
        "numbers_for_a_right_hand_side": _numbers(rates, count),
        "numbers_were_all_gathered": _numbers(gathered, count),
        "numbers_for_a_list": _numbers(renewed, count),
        "list_bytes": sum(leaf.nbytes for leaf in lists),
        "list_bytes_of_a_device": held,
        "seconds_of_a_right_hand_side": _seconds(alone.rates, zero, scene.state, ready),
        "seconds_of_a_list": _seconds(alone.prepare, scene.state),
        "seconds_of_its_sort": _seconds(_sorted, alone.search, scene.state.position),
    }


def _kept(scene: Scene, devices: Devices, halos: bool = True) -> tuple:
    """A model, and a state and its list as steps keep them."""
    model = scene.model().over(devices)
    if not halos:  # of depths that are not known
        walled = scene.walls is not None
        search = dataclasses.replace(model.search.fluid if walled else model.search, depths=())
        search = dataclasses.replace(model.search, fluid=search) if walled else search
        model = dataclasses.replace(model, search=search)
    return model, *eqx.filter_jit(model.begin)(devices.placed(scene.state))


def _numbers(text: str, count: int) -> float:
    """That a program's collectives leave on a device, for each of so many particles."""
    return sum(exchanged(text).values()) / (8 * count)


def _sorted(search, position):
    """What every device does by itself."""
    return Sorted.of(getattr(search, "fluid", search).grid, position)


def _seconds(function: Callable, *given: Any) -> float:
    """Of a processor's cores on one device, at least."""
    program = compiled(lambda *given: function(*given))
    call = {"": lambda: jax.block_until_ready(program(*given))}
    return min(alternate(call, _REPEATS)[1][""])


def differences(scene: Scene, devices: Devices) -> Mapping[str, Any]:
    """Largest differences of a run and of a gradient, relative to the largest value."""
    order = np.random.default_rng(0).permutation(len(scene.state.density))
    other = dataclasses.replace(scene, state=jax.tree.map(lambda a: a[order], scene.state))
    schedule = jaxsph.Schedule(scene.time_step, _STEPS, 1)
    one, many, mixed = (
        jaxsph.simulate(s.model(), s.state, schedule, devices=given)
        for s, given in ((scene, None), (scene, devices.every), (other, None))
    )
    back = np.argsort(order)
    model = scene.model()
    own, shared = (_gradient(scene, each) for each in (model, model.over(devices)))
    way = scene.space.box.displacement(jnp.asarray(one.position[0]), jnp.asarray(one.position[-1]))
    return {
        "particles": one.particles,
        "way_over_half_skin": float(jnp.max(jnp.abs(way)) / (0.5 * model.search.skin)),
        "of_devices": {f: _apart(one, many, f) for f in _FIELDS},
        "of_another_order": {f: _apart(one, mixed, f, back) for f in _FIELDS},
        "of_gradient": max(_relative(a, b) for a, b in zip(own, shared, strict=True)),
    }


_FIELDS = ("position", "velocity", "density")


def _apart(one, other, field: str, order=slice(None)) -> float:
    return _relative(getattr(one, field)[-1], getattr(other, field)[-1][order])


def _relative(a, b) -> float:
    return float(np.max(np.abs(np.asarray(a) - np.asarray(b))) / np.max(np.abs(np.asarray(a))))


@compiled
def _slope(model, state, time_step):
    def energy(state):
        end, *_ = integrate(model, state, jnp.asarray(0), time_step, _GRADIENT_STEPS, 1)
        return jnp.sum(end.velocity**2)

    return jax.grad(energy)(state)


def _gradient(scene: Scene, model) -> list:
    """Of the energy after a few steps in the state before them."""
    dt = jnp.asarray(scene.time_step, scene.state.density.dtype)
    return jax.tree.leaves(_slope(model, scene.state, dt))


KINDS = {"traffic": (traffic, _TRAFFIC), "differences": (differences, SMALL)}


if __name__ == "__main__":
    raise SystemExit(main())
