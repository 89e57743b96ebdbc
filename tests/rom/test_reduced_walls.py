"""Reduced models between walls: the full model's wall rule, particles kept inside, local bases."""

import json
from importlib import import_module

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import ParticleState, SPHFunctional
from jaxsph.arrangements import Lattice
from jaxsph.effects import KickAndHold, NoSlip, WallPressure
from jaxsph.io import read_trajectory
from jaxsph.metrics import vertical_slice
from jaxsph.scenes import couette, lid_driven_cavity, open_cavity
from jaxsph.schemes import DeltaPlus
from jaxsph_rom import Basis, Energy, Galerkin, LocalSplines, PaperAdvection, ReducedModel
from jaxsph_rom.cli import main
from jaxsph_rom.field_advection import FieldAdvection
from jaxsph_rom.study import settled
from jaxsph_rom.study.full_runs import silent

ZERO = jnp.zeros(())


@pytest.fixture(scope="module")
def cavity():
    return lid_driven_cavity(12, 100.0, end_time=0.1, scheme=DeltaPlus())


def full_basis(scene):
    """Each number of the state is a mode of its own."""
    particles = scene.state.position.shape[0]
    modes = np.eye(3 * particles).reshape(particles, 3, 3 * particles)
    product = Energy()
    return Basis(
        modes,
        product.centring.centre(modes, scene.fluid),
        np.asarray(product.weights(scene.fluid, 2)),
        np.ones(modes.shape[2]),
    )


def test_a_full_basis_reproduces_the_full_models_rates_beside_walls(cavity):
    basis = full_basis(cavity)
    points = np.asarray(cavity.state.position)
    splines = LocalSplines.fit(points, basis.modes.reshape(len(points), -1), cavity.space, 3)
    model = ReducedModel.of_scene(cavity, basis, splines, Galerkin(), PaperAdvection())
    rng = np.random.default_rng(0)
    state = ParticleState(
        cavity.state.position,
        jnp.asarray(0.3 * rng.normal(size=points.shape)),
        jnp.asarray(1.0 + 0.005 * rng.normal(size=len(points))),
    )
    effects = PaperAdvection().eulerian(cavity.effects)
    eulerian = eqx.tree_at(lambda s: s.effects, cavity, effects, is_leaf=_is_tuple).functional()
    neighbors = cavity.search().build(state.position)
    expected = eqx.filter_jit(eulerian)(ZERO, state, neighbors)
    assert {"NoSlip", "WallPressure"} <= {e.name for e in eulerian.effects}

    @eqx.filter_jit
    def reduced_rates(model, state):
        reduced = model.project(state)
        rates = model.rates(ZERO, reduced, neighbors)
        return model.basis_at(state.position)[0] @ rates.coordinates

    found = np.asarray(reduced_rates(model, state))
    wanted = np.concatenate([expected.density[:, None], expected.velocity], axis=1)
    # 1e-9 of the largest rate: the condition of the splines' systems
    np.testing.assert_allclose(found, wanted, atol=1e-9 * np.abs(wanted).max())


def _is_tuple(x):
    return isinstance(x, tuple)


def test_a_shear_flow_along_walls_carries_nothing():
    """u = (y, 0) and uniform density: u.grad u = 0 and u.grad rho = 0, up to the walls."""
    scene = couette(12, arrangement=Lattice(), scheme=DeltaPlus())
    x = scene.state.position
    velocity = jnp.stack([x[:, 1], jnp.zeros_like(x[:, 1])], axis=1)
    state = ParticleState(x, velocity, jnp.ones_like(x[:, 0]))

    @eqx.filter_jit
    def advection(effects, neighbors):
        functional = SPHFunctional(effects, scene.fluid, scene.mass, scene.space, scene.walls)
        return functional(ZERO, state, neighbors)

    neighbors = scene.search().build(x)
    rates = advection((FieldAdvection(), WallPressure(), NoSlip()), neighbors)
    # on a lattice the sums along x cancel to round-off
    np.testing.assert_allclose(rates.density, 0.0, atol=1e-12)
    np.testing.assert_allclose(rates.velocity, 0.0, atol=1e-12)


def test_particles_of_a_reduced_model_are_put_back_inside(cavity):
    position = jnp.asarray([[0.5, 0.01], [0.5, 0.5], [-0.01, 0.001], [1.02, 1.03]])
    kept = cavity.walls.put_inside(position, 0.02)
    expected = [[0.5, 0.02], [0.5, 0.5], [0.02, 0.02], [0.98, 0.98]]
    np.testing.assert_allclose(kept, expected, atol=1e-12)
    around_an_edge = open_cavity(48).walls.put_inside(jnp.asarray([[0.301, -0.002]]), 0.002)
    # out of the block through its nearer face, that of the cavity
    np.testing.assert_allclose(around_an_edge, [[0.298, -0.002]], atol=1e-12)


def test_splines_where_walls_take_a_part_of_the_box():
    scene = open_cavity(48)  # its box has cells that lie in the wall altogether
    points = np.asarray(scene.state.position)
    values = points @ np.array([[2.0, 0.5], [-3.0, 1.0]]) + 1.0
    splines = LocalSplines.fit(points, values, scene.space, 3)
    inside = np.random.default_rng(0).permutation(points)[:200]
    inside = inside + 0.3 * scene.space.spacing * np.sign(np.random.default_rng(1).normal(size=2))
    inside = inside[np.asarray(scene.walls.fluid_region.signed_distance(jnp.asarray(inside))) < 0.0]
    # linear along y, which is not periodic; x jumps at the border of the box
    column = 1 if abs(values[0, 1]) else 0
    away = np.abs(inside[:, 0] - 0.2) < 0.12
    found = np.asarray(splines(jnp.asarray(inside[away])))
    expected = inside[away] @ np.array([[2.0, 0.5], [-3.0, 1.0]]) + 1.0
    np.testing.assert_allclose(found[:, column], expected[:, column], atol=1e-9)


def test_probes_at_any_x(cavity):
    line = vertical_slice(cavity.space, 0.25)
    assert line.shape == (12, 2) and np.all(line[:, 0] == 0.25)
    np.testing.assert_allclose(line[[0, -1], 1], [1 / 24, 23 / 24])
    with pytest.raises(ValueError, match="x = 3 m is outside the box"):
        vertical_slice(cavity.space, 3.0)


def test_a_settled_start_goes_on_from_the_run_from_rest(tmp_path):
    def make(reynolds, start_time=0.0, end_time=0.004, **more):
        return open_cavity(
            48, reynolds, start_time=start_time, end_time=end_time, scale="small", **more
        )

    scene = settled(make, 0.05, tmp_path, silent)(2400.0)
    speed = np.linalg.norm(scene.state.velocity, axis=1)
    assert 0.3 < speed.mean() < 1.0  # kicked: about 1 m/s over half the channel
    (drive,) = (effect for effect in scene.effects if isinstance(effect, KickAndHold))
    above = drive.acceleration(ZERO, jnp.asarray([[0.2, 0.05], [0.2, -0.05], [0.35, 0.05]]))
    np.testing.assert_allclose(above[:, 0], [0.1, 0.0, 0.0], atol=1e-4)  # the kick is over
    stamp = {p: p.stat().st_mtime_ns for p in tmp_path.rglob("*.h5")}
    again = settled(make, 0.05, tmp_path, silent)(2400.0)
    np.testing.assert_array_equal(again.state.position, scene.state.position)
    assert stamp == {p: p.stat().st_mtime_ns for p in tmp_path.rglob("*.h5")}


@pytest.mark.slow
def test_most_of_the_settling_runs_at_half_the_resolution(tmp_path, monkeypatch):
    monkeypatch.setattr(import_module("jaxsph_rom.study.settled"), "_COARSEST", 24)

    def make(reynolds, resolution=48, start_time=0.0, end_time=0.004, **more):
        return open_cavity(resolution, reynolds, start_time=start_time, end_time=end_time, **more)

    scene = settled(make, 0.05, tmp_path, silent)(2400.0)
    coarse = tmp_path / "resolution-24" / "re-2400" / "trajectory.h5"
    last = tmp_path / "re-2400" / "trajectory.h5"
    assert read_trajectory(coarse).time[-1] == pytest.approx(0.04)
    fine = read_trajectory(last)
    assert fine.time[-1] == pytest.approx(0.01) and fine.particles == len(scene.state.density)
    np.testing.assert_array_equal(fine.position[-1], scene.state.position)
    before = np.linalg.norm(read_trajectory(coarse).velocity[-1], axis=1).mean()
    assert np.linalg.norm(fine.velocity[0], axis=1).mean() == pytest.approx(before, rel=0.1)


@pytest.mark.slow
def test_local_bases_from_one_line(tmp_path, capsys):
    arguments = ["run", "lid-driven-cavity", "--resolution", "12", "--t-end", "0.08",
                 "--train", "50", "100", "150", "--predict", "75", "125", "--modes", "2",
                 "--borders", "50", "100", "150", "--slice", "0.25",
                 "--out", str(tmp_path)]  # fmt: skip
    assert main(arguments) == 0
    report = json.loads((tmp_path / "report.json").read_text())
    assert [basis["trained_on"] for basis in report["bases"]] == [[50.0, 100.0], [100.0, 150.0]]
    assert [case["trained_on"] for case in report["cases"]] == [[50.0, 100.0], [100.0, 150.0]]
    assert all(case["stable"] for case in report["cases"])
    assert {"modes_1.png", "modes_2.png"} <= {path.name for path in tmp_path.glob("*.png")}
    assert main([*arguments[:-2], "--predict", "200", "--out", str(tmp_path / "b")]) == 2
    assert "200 is outside [50, 150]" in capsys.readouterr().err.splitlines()[-1]
