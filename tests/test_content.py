"""What tells one scene from another: everything that changes a run, and nothing else."""

import dataclasses
import os
import subprocess
import sys
from functools import partial
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxsph
from jaxsph import BoxRegion, MovingBody, TaitEquationOfState
from jaxsph.arrangements import Lattice
from jaxsph.body_state import BodyState
from jaxsph.content import content, differences, digest
from jaxsph.effects import BodyForce, Gravity
from jaxsph.kernels import WendlandC4
from jaxsph.scenes import dam_break, lid_driven_cavity, taylor_green


def vortex():
    return taylor_green(12, arrangement=Lattice(), end_time=0.05)


def changed(where, value):
    return eqx.tree_at(where, vortex(), value)


def replaced(**fields):
    return dataclasses.replace(vortex(), **fields)


@pytest.mark.parametrize(
    ("other", "name"),
    [
        (lambda: changed(lambda s: s.effects[2].viscosity, jnp.asarray(0.02)),
         "effects[2].viscosity is 0.01 (float64) there and 0.02 (float64) here"),
        (lambda: changed(lambda s: s.fluid.sound_speed, jnp.asarray(11.0)), "fluid.sound_speed"),
        (lambda: changed(lambda s: s.state.velocity, vortex().state.velocity.at[7, 1].add(1e-8)),
         "state.velocity has other values"),
        (lambda: changed(lambda s: s.state.density, vortex().state.density.astype("float32")),
         "state.density"),
        (lambda: changed(lambda s: s.fluid.equation_of_state, TaitEquationOfState()),
         "fluid.equation_of_state is jaxsph.fluid.LinearEquationOfState there"),
        (lambda: replaced(effects=(*vortex().effects, Gravity(jnp.array([0.0, -1.0])))),
         "effects[7] is missing there"),
        (lambda: replaced(space=dataclasses.replace(vortex().space, kernel=WendlandC4())),
         "space.kernel"),
        (lambda: replaced(steps_per_snapshot=1), "steps_per_snapshot is 2 there and 1 here"),
        (lambda: taylor_green(12, 50.0, arrangement=Lattice(), end_time=0.05),
         "parameters.reynolds is 100 there and 50 here"),
    ],
)  # fmt: skip
def test_what_changes_a_run_is_named(other, name):
    assert name in differences(content(vortex()), content(other()))
    assert digest(vortex()) != digest(other())


@pytest.mark.parametrize("make", [
    vortex,
    partial(lid_driven_cavity, 16),
    partial(dam_break, 16, arrangement=Lattice()),
])  # fmt: skip
def test_made_again_it_is_the_same(make):
    jax.clear_caches()
    assert differences(content(make()), content(make())) == ""


def test_round_off_of_another_processor_is_no_difference():
    rng = np.random.default_rng(1)
    for dtype, off in (("float64", 1e-16), ("float32", 1e-9)):
        values = rng.normal(size=400).astype(dtype)
        values[0] = 4.0  # the largest, where a binary exponent begins
        near = (values * (1.0 - off * rng.random(400))).astype(dtype)
        assert dtype == "float32" or (near != values).any()
        assert content(near) == content(values)
        for factor in (1.0 + 1e-4, 0.5, -1.0):
            assert content(values * np.asarray(factor, dtype)) != content(values)


class Stirrer(BodyForce):
    amplitude: float = 2.0

    def acceleration(self, time, position):
        return self.amplitude * jnp.sin(time) * position


def stirrer(factor):
    class Stirrer(BodyForce):
        def acceleration(self, time, position):
            return factor * position

    return Stirrer()


SPEED = 3.0


def test_the_code_of_own_functions_and_classes_counts():
    assert differences(content(stirrer(1.0)), content(stirrer(2.0))) == (
        "acceleration()(factor) is 1 there and 2 here"
    )
    body = content(Stirrer())
    assert body["amplitude"] == "2" and "acceleration()" in body

    def pushed(way):
        return MovingBody(BoxRegion((0.0, 0.0), (1.0, 1.0)), lambda t: jnp.stack([way * t, 0 * t]))

    assert "displacement(way) is 1 there" in differences(content(pushed(1)), content(pushed(2)))
    one, two = (lambda t: t * 2.0), (lambda t: t * 3.0)
    assert "has other values" in differences(content(one), content(two))
    assert content(lambda t: t * SPEED)["(SPEED)"] == "3"
    named = partial(lambda t, speed: t * speed, speed=SPEED)
    assert content(named)["named.speed"] == "3"
    assert content(jax.jit(one))["function"] == content(one)[""]


def test_it_is_the_same_in_another_process():
    """Where sets have another order."""
    script = (
        "from jaxsph.content import digest\n"
        "def chosen(t, names=frozenset('abcdefgh')): return t in {'u', 'v', 'w', 'x', 'y', 'z'}\n"
        "print(digest(chosen))"
    )
    root = str(Path(jaxsph.__file__).parents[1])
    found = set()
    for seed in "123":
        environment = {**os.environ, "PYTHONPATH": root, "PYTHONHASHSEED": seed}
        found.add(subprocess.check_output([sys.executable, "-c", script], env=environment))
    assert len(found) == 1


def again(n):
    return n if n < 2 else again(n - 1)


def test_odd_parts():
    assert content(again)["(again)"] == "itself"
    assert content({"a": [1, 2.5, None], "b": np.float32(1)}) == {
        "": "parts", "a": "(1, 2.5, None)", "b": "1"}  # fmt: skip
    assert content(jax.random.key(3)) == content(jax.random.key(3)) != content(jax.random.key(4))
    with pytest.raises(ValueError, match=r"force\[1\]: object cannot be recorded"):
        content({"force": [1.0, object()]})


def test_a_part_that_came_later_counts_where_it_is_set():
    """So records of runs that were made before there were free bodies hold."""
    scene = vortex()
    assert scene.state.bodies is None
    assert not [name for name in content(scene) if "bodies" in name]
    one = jnp.zeros((1, 2))
    afloat = dataclasses.replace(scene.state, bodies=BodyState(one, one[:, 0], one, one[:, 0]))
    kept, wanted = content(scene.state), content(afloat)
    assert "bodies is missing there" in differences(kept, wanted)
    assert digest(afloat) != digest(scene.state)
