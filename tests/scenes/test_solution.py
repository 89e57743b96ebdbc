"""Scenes that know their exact flow: what it is, and that an edited scene has it no longer."""

import dataclasses
import json

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph.arrangements import Lattice
from jaxsph.cli import main
from jaxsph.content import content
from jaxsph.effects import FreeSlip, Gravity, LaminarViscosity
from jaxsph.scenes import (
    balanced,
    couette,
    gresho_vortex,
    hydrostatic_tank,
    plane_flow_solution,
    poiseuille,
    shear_layer,
    taylor_green,
    taylor_green_3d,
)

HEIGHT = np.linspace(0.0, 1.0, 7)  # m


def vortex(**given):
    return taylor_green(12, arrangement=Lattice(), end_time=0.05, **given)


def tank(**given):
    return hydrostatic_tank(12, **given)


def eddy(**given):
    return gresho_vortex(16, arrangement=Lattice(), **given)


@pytest.mark.parametrize("make", [vortex, eddy, tank])
@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_the_start_is_the_exact_one(make, dtype):
    scene = make(dtype=dtype)
    velocity, pressure = scene.exact(scene.state.position, 0.0)
    tolerance = 1e-12 if dtype == "float64" else 1e-5  # of the speed, which is 1 m/s
    np.testing.assert_allclose(velocity, scene.state.velocity, atol=tolerance)
    density = scene.fluid.density(jnp.asarray(pressure, dtype))
    np.testing.assert_allclose(density, scene.state.density, rtol=tolerance)


@pytest.mark.parametrize(
    ("make", "speed"),
    [
        (lambda: couette(20, 10.0), lambda y, t: y),
        (lambda: poiseuille(20, 10.0), lambda y, t: 4.0 * y * (1.0 - y)),
    ],
)
def test_channels_become_steady(make, speed):
    scene = make()
    position = np.asarray(scene.state.position)
    velocity, pressure = scene.exact(position, 50.0)
    np.testing.assert_allclose(velocity[:, 0], speed(position[:, 1], 50.0), atol=1e-12)
    assert not velocity[:, 1].any() and not pressure.any()
    rest, _ = scene.exact(position, 0.0)
    np.testing.assert_allclose(rest, 0.0, atol=1e-6)  # 200 terms of the channel's series


def test_channels_know_their_viscosity_and_force():
    expected = {
        couette: plane_flow_solution.couette(HEIGHT, 0.4, 0.05),
        poiseuille: plane_flow_solution.poiseuille(HEIGHT, 0.4, 0.05, 0.4),
    }
    for make, flow in expected.items():
        velocity, _ = make(20, 20.0).exact(np.stack([0.0 * HEIGHT, HEIGHT], axis=1), 0.4)
        np.testing.assert_allclose(velocity[:, 0], flow, rtol=1e-12)


def test_scenes_without_one():
    assert taylor_green_3d(8, arrangement=Lattice(), h_over_dx=1.2).exact is None
    assert shear_layer(16, arrangement=Lattice()).exact is None
    assert couette(20, wall_velocity=FreeSlip()).exact is None


@pytest.mark.parametrize(
    "edit",
    [
        lambda s: dataclasses.replace(s, effects=(*s.effects, Gravity(jnp.array([0.0, -1.0])))),
        lambda s: eqx.tree_at(lambda s: s.effects[2], s, LaminarViscosity(jnp.asarray(0.02))),
        lambda s: eqx.tree_at(lambda s: s.state.velocity, s, 2.0 * s.state.velocity),
        lambda s: dataclasses.replace(s, state=jax.tree.map(lambda a: 1.001 * a, s.state)),
        lambda s: eqx.tree_at(lambda s: s.fluid.reference_density, s, jnp.asarray(1010.0)),
    ],
)  # fmt: skip
def test_an_edited_scene_has_it_no_longer(edit):
    assert vortex().exact is not None
    assert edit(vortex()).exact is None


def test_edits_that_leave_the_flow_keep_it():
    scene = vortex()
    named = dataclasses.replace(scene, name="mine", end_time=0.1, parameters={})
    assert named.exact is scene.exact
    fewer = dataclasses.replace(scene, effects=scene.effects[:4], solution=scene.exact)
    assert fewer.exact == scene.exact  # without shifting, and said to be the same flow
    assert balanced(scene).exact == scene.exact
    assert dataclasses.replace(fewer, effects=scene.effects[:3]).exact is None


def test_it_is_no_part_of_what_a_run_is_known_by():
    assert content(vortex()) == content(dataclasses.replace(vortex(), solution=None))


OWN = '''
import dataclasses
from jaxsph.arrangements import Lattice
from jaxsph.scenes import taylor_green


def make():
    scene = taylor_green(12, arrangement=Lattice(), end_time=0.05)
    return dataclasses.replace(scene{edit})
'''


@pytest.mark.parametrize(
    ("edit", "compared"), [(', name="mine"', True), (", effects=scene.effects[:2]", False)]
)
def test_command_line_compares_what_is_known(tmp_path, edit, compared, capsys):
    file, report = tmp_path / "own.py", tmp_path / "run.json"
    file.write_text(OWN.format(edit=edit))
    out = ["--out", str(tmp_path / "run"), "--json", str(report)]
    assert main(["run", f"{file}:make", *out]) == 0
    errors = json.loads(report.read_text())["errors"]
    assert (errors is not None) == compared == ("velocity error" in capsys.readouterr().out)
    if compared:
        assert 0.0 < errors["velocity_relative_l2"] < 0.1
