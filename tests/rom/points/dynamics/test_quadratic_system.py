"""Operators on reference points and the tensors made of them."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import run_scene
from jaxsph.arrangements import Lattice
from jaxsph.effects import IsotropicViscosity, Varying
from jaxsph.integrate import integrate
from jaxsph.scenes import couette, lid_driven_cavity, open_cavity, poiseuille_open, taylor_green
from jaxsph.scenes import taylor_green_solution as exact
from jaxsph.schemes import DeltaPlus
from jaxsph_rom import Basis, Energy, ReferenceSpace, pod
from jaxsph_rom.points import (
    PointsModel,
    QuadraticSystem,
    ReferenceOperators,
    from_log_density,
    galerkin_system,
    to_log_density,
)
from jaxsph_rom.points.dynamics.quadratic_system import advective, skew_symmetric

VISCOSITY = 0.01


def random_basis(scene, modes=4, seed=0):
    """Smooth random modes, orthonormal in the energy product."""
    x, rng = np.asarray(scene.state.position), np.random.default_rng(seed)
    wave = 2 * np.pi * rng.integers(1, 3, size=(3, 2, 2 * modes))
    phase = rng.uniform(0, 2 * np.pi, size=(3, 1, 2 * modes))
    fields = np.sin(np.einsum("gd,fdm->fgm", x, wave) + phase).transpose(1, 0, 2)
    rest = float(scene.fluid.reference_density)
    fields[:, 0] = rest * (1.0 + 0.01 * fields[:, 0])
    return pod(fields, Energy(), scene.fluid, modes)


@pytest.fixture(scope="module")
def vortex():
    return taylor_green(16, 100.0, arrangement=Lattice(), scheme=DeltaPlus())


@pytest.fixture(scope="module")
def cavity():
    return lid_driven_cavity(16, 100.0)


@pytest.fixture(scope="module")
def channel():
    return poiseuille_open(8, h_over_dx=1.5, arrangement=Lattice())


@pytest.mark.parametrize("name", ["vortex", "cavity", "channel"])
def test_tensors_are_the_projected_operators(name, request):
    scene = request.getfixturevalue(name)
    basis, points = random_basis(scene), scene.state.position
    system = galerkin_system(scene, basis, points, advective)
    operators = ReferenceOperators.of_scene(scene, points)
    a = np.random.default_rng(1).normal(size=basis.size)
    fields = jnp.asarray(basis.centre + basis.modes @ a)
    gradient = operators.gradients(fields)
    rates = operators.affine(fields, jnp.asarray(VISCOSITY))
    rates = rates - jnp.einsum("gd,gfd->gf", fields[:, 1:], gradient)
    wanted = np.einsum("gfm,f,gf->m", basis.modes, basis.weights, rates)
    found = system(jnp.asarray(a), jnp.asarray(VISCOSITY))
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-11 * np.abs(wanted).max())


def test_an_inflow_that_changes_is_not_for_tensors(channel):
    *others, fringe = channel.effects
    fringe = dataclasses.replace(fringe, profile=Varying(fringe.profile, jnp.cos))
    with pytest.raises(ValueError, match="Fringe changes with time"):
        ReferenceOperators.of_scene(
            dataclasses.replace(channel, effects=(*others, fringe)), channel.state.position
        )


@pytest.mark.parametrize("form", [skew_symmetric, advective])
@pytest.mark.parametrize("name", ["vortex", "cavity"])
def test_the_system_does_not_depend_on_the_centre(name, form, request):
    """About rest, about a mean that moves, and about zero: other coordinates, the same rates."""
    scene = request.getfixturevalue(name)
    some, points = random_basis(scene), scene.state.position
    root = np.sqrt(some.weights)[None, :, None]
    uniform = np.zeros_like(some.modes[:, :, :1])
    uniform[:, 0] = 1.0
    stacked = np.concatenate([uniform, some.modes], axis=2) * root
    modes = np.linalg.qr(stacked.reshape(-1, 5))[0].reshape(stacked.shape) / root
    about_rest = Basis(modes, some.centre, some.weights, some.singular_values)
    wanted = galerkin_system(scene, about_rest, points, form)
    rng = np.random.default_rng(2)
    of_rest = np.einsum("gfm,f,gf->m", modes, some.weights, some.centre + 0.0 * modes[:, :, 0])
    a, viscosity = rng.normal(size=5), jnp.asarray(VISCOSITY)
    rates = wanted(jnp.asarray(a), viscosity)
    for shift in (rng.normal(size=5), -of_rest):
        moved = Basis(modes, some.centre + modes @ shift, some.weights, some.singular_values)
        found = galerkin_system(scene, moved, points, form)(jnp.asarray(a - shift), viscosity)
        scale = np.abs(rates).max() + np.abs(shift).max()  # that the terms have before they cancel
        np.testing.assert_allclose(found, rates, rtol=0, atol=1e-10 * scale)


def test_operators_are_the_full_models_right_hand_side_about_rest(vortex):
    # small amplitudes: what is quadratic goes, and so does the difference of rho and its logarithm
    operators = ReferenceOperators.of_scene(vortex, vortex.state.position)
    rest = jnp.zeros((len(vortex.state.position), 3)).at[:, 0].set(1000.0)
    state = vortex.state
    fields = jnp.concatenate([state.density[:, None], state.velocity], axis=1)
    fields = rest + 1e-5 * (fields - rest)
    small = type(state)(state.position, fields[:, 1:], fields[:, 0])
    kept = operators.functional
    full = kept(jnp.zeros(()), small, operators.neighbors)
    (viscosity,) = (e.viscosity for e in kept.effects if isinstance(e, IsotropicViscosity))
    found = operators.affine(fields, viscosity)
    for mine, theirs in ((found[:, 0], full.density), (found[:, 1:], full.velocity)):
        scale = float(jnp.abs(theirs).max())
        np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-4 * scale)


def test_walls_reach_the_operators():
    scene = couette(16, 10.0, arrangement=Lattice(), scheme=DeltaPlus())
    operators = ReferenceOperators.of_scene(scene, scene.state.position)
    y = np.asarray(scene.state.position)[:, 1]
    linear = jnp.zeros((len(y), 3)).at[:, 0].set(scene.fluid.reference_density).at[:, 1].set(y)
    slope = operators.gradients(linear)[:, 1, 1]  # of the steady flow under the sliding wall
    np.testing.assert_allclose(slope, 1.0, atol=0.2)
    rest = linear.at[:, 1].set(0.0)
    pull = operators.affine(rest, jnp.asarray(1.0))[:, 1]
    assert float(pull[y > 0.9].min()) > 0.0  # the sliding wall drags fluid at rest
    np.testing.assert_allclose(pull[y < 0.6], 0.0, atol=1e-12)


def test_skew_symmetric_advection_makes_no_energy(vortex):
    basis = random_basis(vortex, 5)
    system = galerkin_system(vortex, basis, vortex.state.position)
    plain = galerkin_system(vortex, basis, vortex.state.position, advective)
    for seed in range(3):
        a = jnp.asarray(np.random.default_rng(seed).normal(size=5))
        made = float(jnp.einsum("kij,k,i,j", system.quadratic, a, a, a))
        assert abs(made) < 1e-12 * float(jnp.abs(system.quadratic).max())
    assert abs(float(jnp.einsum("kij,k,i,j", plain.quadratic, a, a, a))) > 1e-3


def test_sound_alone_keeps_its_energy(vortex):
    without = eqx.tree_at(
        lambda s: s.effects, vortex, vortex.effects[:3], is_leaf=lambda x: isinstance(x, tuple)
    )  # continuity, pressure, viscosity: no density diffusion
    system = galerkin_system(without, random_basis(vortex, 6), vortex.state.position)
    symmetric = system.linear[0] + system.linear[0].T
    assert float(jnp.abs(symmetric).max()) < 1e-12 * float(jnp.abs(system.linear[0]).max())
    decay = np.linalg.eigvalsh(system.linear[1] + system.linear[1].T)
    assert decay.max() < 1e-10  # viscosity only takes


def test_a_truncated_system_is_that_of_the_first_modes(vortex):
    basis = random_basis(vortex, 5)
    whole = galerkin_system(vortex, basis, vortex.state.position).truncated(3)
    part = galerkin_system(vortex, basis.truncated(3), vortex.state.position)
    for name in ("constant", "linear", "quadratic"):
        np.testing.assert_allclose(getattr(whole, name), getattr(part, name), atol=1e-9)


def test_log_density_goes_there_and_back(vortex):
    density = jnp.asarray([950.0, 1000.0, 1050.0])
    log_density = to_log_density(density, vortex.fluid)
    np.testing.assert_allclose(from_log_density(log_density, vortex.fluid), density, rtol=1e-14)
    np.testing.assert_allclose(log_density, density, rtol=1.4e-3)  # second order in 5 percent


def test_a_vortex_decays_as_it_should_in_the_full_models_loop():
    scene = taylor_green(32, 100.0, arrangement=Lattice(), end_time=0.2)
    points, time = scene.state.position, 0.02 * np.arange(11)
    snapshots = []
    for t in time:
        velocity = exact.velocity(points, t, VISCOSITY)
        pressure = exact.pressure(points, t, VISCOSITY, 1000.0)
        density = to_log_density(scene.fluid.density(pressure), scene.fluid)
        snapshots.append(np.concatenate([density[:, None], velocity], axis=1))
    basis = pod(np.stack(snapshots, axis=-1), Energy(), scene.fluid, 2)
    model = PointsModel(galerkin_system(scene, basis, points), VISCOSITY)
    first = snapshots[0] - basis.centre
    start = np.einsum("gfm,f,gf->m", basis.modes, basis.weights, first)
    _, fault, found, good = jax.jit(lambda a: integrate(model, a, 0, jnp.asarray(2e-3), 10, 10))(
        jnp.asarray(start)
    )
    assert int(fault.code) == 0 and bool(good.all()) and found.shape == (10, 2)
    energy = np.sum(np.asarray(found) ** 2, axis=1) / np.sum(start**2)
    wanted = np.exp(-16 * np.pi**2 * VISCOSITY * time[1:])
    np.testing.assert_allclose(np.log(energy), np.log(wanted), rtol=0.025)  # the kernel smooths


def test_a_run_is_mapped_into_log_density():
    scene = taylor_green(16, 100.0, arrangement=Lattice(), end_time=0.02)
    trajectory = run_scene(scene)
    snapshots = ReferenceSpace(scene.state.position, scene.space).snapshots(trajectory)
    logarithms = to_log_density(jnp.asarray(snapshots[:, 0]), scene.fluid)
    assert snapshots.shape[2] == len(trajectory.time) and bool(jnp.isfinite(logarithms).all())


def test_a_force_that_changes_with_time_is_refused():
    scene = open_cavity(16)
    with pytest.raises(ValueError, match="KickAndHold changes with time.*Samples"):
        ReferenceOperators.of_scene(scene, scene.state.position)


def test_a_force_that_has_settled_is_a_constant_part():
    scene = open_cavity(16, start_time=5.0)
    operators = ReferenceOperators.of_scene(scene, scene.state.position)
    place = np.asarray(scene.state.position)
    rest = jnp.zeros((len(place), 3)).at[:, 0].set(scene.fluid.reference_density)
    found = operators.affine(rest, jnp.zeros(()))
    driven = (np.abs(place[:, 0] - 0.2) < 0.1) & (np.abs(place[:, 1] - 0.05) < 0.02)
    np.testing.assert_allclose(found[driven, 1], 0.1, rtol=1e-9)  # b0 k0
    system = galerkin_system(scene, random_basis(scene), place)
    assert float(jnp.abs(system.constant[0]).max()) > 0.0


def test_rates_are_those_of_the_formula():
    rng = np.random.default_rng(3)
    system = QuadraticSystem(
        *(jnp.asarray(rng.normal(size=shape)) for shape in ((2, 4), (2, 4, 4), (4, 4, 4)))
    )
    a, viscosity = rng.normal(size=4), 0.3
    wanted = system.constant[0] + viscosity * system.constant[1]
    wanted += (system.linear[0] + viscosity * system.linear[1]) @ a
    wanted += np.einsum("kij,i,j->k", system.quadratic, a, a)
    found = system(jnp.asarray(a), jnp.asarray(viscosity))
    np.testing.assert_allclose(found, wanted, rtol=1e-13, atol=1e-13)
