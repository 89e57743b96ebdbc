"""Free surfaces: found where they are, left alone by shifting, and under tension round."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import Box, Fluid, ParticleState, SPHFunctional, TaitEquationOfState
from jaxsph.arrangements import JitteredLattice, Lattice
from jaxsph.effects import (
    ArtificialViscosity,
    BackgroundPressure,
    CentralForce,
    DensityDiffusion,
    FreeSurface,
    LaminarViscosity,
    ParticleShifting,
    PressureForce,
    SurfaceDiffusion,
    SurfaceShifting,
    SurfaceTension,
    TensileControl,
)
from jaxsph.kernels import WendlandC2
from jaxsph.neighbors import NeighborSearch
from jaxsph.pairs import Space
from jaxsph.scenes import dam_break, hydrostatic_tank, oscillating_drop, taylor_green
from jaxsph.symmetric import smallest_eigenvalue

DX = 0.05
FLUID = Fluid(1.0, 10.0, 1.0)


def slab():
    """A layer of fluid with a flat surface at y = 0, periodic along x, 12 rows deep."""
    space = Space(Box((0.0, -1.0), (1.0, 1.0), (True, False)), WendlandC2(), 2.0 * DX, DX)
    position = Lattice().positions(space)
    return space, position[(position[:, 1] < 0.0) & (position[:, 1] > -12.0 * DX)]


def made(effects, space, position, velocity=None, density=None, fluid=FLUID):
    """Context, fields, sums and rates, all in the particles' own order."""
    count = position.shape[0]
    state = ParticleState(
        position,
        jnp.zeros_like(position) if velocity is None else velocity,
        jnp.ones(count) if density is None else density,
    )
    search = NeighborSearch.allocate(position, space.box, space.support, 0.1 * space.spacing)
    mass = fluid.reference_density * space.spacing**space.box.dim
    return evaluated(SPHFunctional(effects, fluid, mass, space), search, state)


@eqx.filter_jit
def evaluated(functional, search, state):
    neighbors, start = search.build(state.position), jnp.zeros(())
    _, fields, _ = functional.sums(start, state, neighbors)
    fields = {name: neighbors.unsort(field) for name, field in fields.items()}
    return fields, functional(start, state, neighbors)


@pytest.mark.parametrize("dim", [2, 3])
def test_the_smallest_eigenvalue_is_that_of_a_direct_solver(dim):
    matrices = np.random.default_rng(0).normal(size=(50, dim, dim))
    matrices = matrices + matrices.swapaxes(1, 2)
    rows, columns = np.triu_indices(dim)
    found = smallest_eigenvalue(jnp.asarray(matrices[:, rows, columns]))
    # of three dimensions the arc cosine loses half the digits where two eigenvalues meet
    np.testing.assert_allclose(found, np.linalg.eigvalsh(matrices)[:, 0], rtol=1e-7, atol=1e-8)


@pytest.mark.parametrize("dim", [2, 3])
def test_equal_eigenvalues_have_a_finite_derivative(dim):
    upper = jnp.asarray(np.eye(dim)[np.triu_indices(dim)])[None, :]
    slope = jax.grad(lambda a: smallest_eigenvalue(a)[0])(upper)
    assert np.isfinite(slope).all()
    assert smallest_eigenvalue(upper)[0] == pytest.approx(1.0)


def test_rows_under_a_flat_surface_are_told_from_those_inside():
    space, position = slab()
    fields, _ = made((FreeSurface(),), space, position)
    depth = -np.asarray(position[:, 1]) / DX
    middle = (depth > 4.0) & (depth < 8.0)
    np.testing.assert_array_equal(fields["interior"][middle], 1.0)
    np.testing.assert_array_equal(fields["interior"][depth < 3.0], 0.0)
    np.testing.assert_array_equal(fields["coherent"], 1.0)
    upward = np.broadcast_to([0.0, 1.0], (int((depth < 1.0).sum()), 2))
    np.testing.assert_allclose(fields["surface_normal"][depth < 1.0], upward, atol=1e-12)


def test_a_particle_that_flies_alone_is_not_coherent():
    space, position = slab()
    position = jnp.concatenate([position, jnp.asarray([[0.5, 0.5]])])
    fields, _ = made((FreeSurface(),), space, position)
    assert fields["coherent"][-1] == 0.0
    np.testing.assert_array_equal(fields["surface_normal"][-1], 0.0)


def fields_of(scene):
    return evaluated(scene.functional(), scene.search(), scene.state)[0]


def test_a_wall_is_no_free_surface():
    tank = hydrostatic_tank(16)
    tank = dataclasses.replace(tank, effects=(*tank.effects, FreeSurface()))
    # at the floor the water is compressed by 1 percent, and the eigenvalue with the volumes
    assert np.asarray(fields_of(tank)["interior"]).min() > 0.9


def test_the_column_of_a_dam_break_has_its_surface_on_two_sides():
    scene = dam_break(50)
    interior = np.asarray(fields_of(scene)["interior"])
    x = np.asarray(scene.state.position)
    width, height = scene.parameters["column"]
    near = (width - x[:, 0] < 1.5 * scene.space.spacing) | (
        height - x[:, 1] < 1.5 * scene.space.spacing
    )
    far = (width - x[:, 0] > 4.0 * scene.space.spacing) & (
        height - x[:, 1] > 4.0 * scene.space.spacing
    )
    assert interior[near].max() == 0.0
    assert interior[far].min() == 1.0


def test_shifting_does_not_cross_the_surface():
    space, position = slab()
    position = position + 0.1 * DX * jnp.sin(40.0 * position[:, ::-1])
    fields, rates = made((ParticleShifting(), FreeSurface(), SurfaceShifting()), space, position)
    raw, _ = made((ParticleShifting(),), space, position)
    top = np.asarray(position[:, 1]) > -0.9 * DX
    normal = np.asarray(fields["surface_normal"])
    across = (np.asarray(rates.position) * normal).sum(axis=1)
    before = (np.asarray(raw["shift_velocity"]) * normal).sum(axis=1)
    assert np.abs(before[top]).min() > 0.1
    np.testing.assert_allclose(across[top], 0.0, atol=1e-12)
    along = np.asarray(rates.position)[top][:, 0]
    assert np.abs(along).max() > 1e-3
    inside = np.asarray(fields["interior"]) == 1.0
    found, wanted = (np.asarray(a)[inside] for a in (rates.position, raw["shift_velocity"]))
    # of the largest: two programs add up in another order, and some components are near zero
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-13 * np.abs(wanted).max())


def test_the_density_of_a_hydrostatic_column_is_not_diffused_at_its_surface():
    space, position = slab()
    density = 1.0 - 0.01 * position[:, 1]
    effects = (DensityDiffusion(0.1), FreeSurface(), SurfaceDiffusion())
    _, rates = made(effects, space, position, density=density)
    depth = -np.asarray(position[:, 1]) / DX
    # volumes vary by 0.6 percent over the layer, so the gradient is exact to that
    np.testing.assert_allclose(rates.density[depth < 8.0], 0.0, atol=1e-3)
    jump = 1.0 + 0.01 * (depth < 1.0)
    _, rates = made(effects, space, position, density=jnp.asarray(jump))
    assert np.abs(np.asarray(rates.density)[depth < 1.0]).min() > 0.05


def test_uniform_tension_exerts_no_force_on_any_arrangement():
    space = Space(Box.unit_periodic(2), WendlandC2(), 2.0 * DX, DX)
    position = JitteredLattice(0.4).positions(space)
    density = jnp.full(position.shape[0], 0.99)
    _, plain = made((PressureForce(),), space, position, density=density)
    _, held = made((PressureForce(), TensileControl()), space, position, density=density)
    assert np.abs(plain.velocity).max() > 1.0
    np.testing.assert_allclose(held.velocity, 0.0, atol=1e-10)


def test_pressure_above_zero_is_left_alone():
    space = Space(Box.unit_periodic(2), WendlandC2(), 2.0 * DX, DX)
    position = JitteredLattice(0.4).positions(space)
    density = jnp.full(position.shape[0], 1.01)
    _, rates = made((TensileControl(),), space, position, density=density)
    np.testing.assert_array_equal(rates.velocity, 0.0)


def test_a_background_pressure_is_a_constant_added_to_the_pressure():
    space = Space(Box.unit_periodic(2), WendlandC2(), 2.0 * DX, DX)
    position = JitteredLattice(0.4).positions(space)
    density = 1.0 + 0.01 * jnp.sin(6.0 * position[:, 0])
    _, added = made((PressureForce(), BackgroundPressure(3.0)), space, position, density=density)

    class Raised(TaitEquationOfState):
        def pressure(self, density, reference_density, sound_speed):
            return sound_speed**2 * (density - reference_density) + 3.0

    raised = dataclasses.replace(FLUID, equation_of_state=Raised())
    _, rates = made((PressureForce(),), space, position, density=density, fluid=raised)
    np.testing.assert_allclose(added.velocity, rates.velocity, atol=1e-10)


@pytest.mark.parametrize("dim", [2, 3])
def test_artificial_viscosity_is_a_laminar_one_of_the_smoothing_length(dim):
    space = Space(Box.unit_periodic(dim), WendlandC2(), 0.2, 0.1)
    position = JitteredLattice(0.2).positions(space)
    velocity = jnp.sin(6.0 * position[:, ::-1])
    nu = 0.05 * 0.2 * 10.0 / (2.0 * (dim + 2))
    _, rates = made((ArtificialViscosity(0.05),), space, position, velocity)
    _, expected = made((LaminarViscosity(nu),), space, position, velocity)
    np.testing.assert_allclose(rates.velocity, expected.velocity, rtol=1e-12)


def test_tait_is_its_own_inverse_and_linear_at_first():
    tait = Fluid(1000.0, 20.0, 2.0, TaitEquationOfState())
    density = jnp.linspace(900.0, 1100.0, 9)
    np.testing.assert_allclose(tait.density(tait.pressure(density)), density, rtol=1e-12)
    assert float(tait.pressure(jnp.asarray(1000.0))) == 0.0
    assert float(jax.grad(tait.pressure)(jnp.asarray(1000.0))) == pytest.approx(400.0)
    assert float(tait.density(jnp.asarray(-1e9))) == pytest.approx(500.0)


def test_a_central_force_pulls_in_proportion_to_the_distance():
    force = CentralForce(2.0, (1.0, 0.0))
    found = force.acceleration(jnp.zeros(()), jnp.asarray([[1.0, 0.0], [2.0, 3.0]]))
    np.testing.assert_allclose(found, [[0.0, 0.0], [-4.0, -12.0]])


def round_drop(resolution):
    scene = oscillating_drop(resolution)
    return scene.space, scene.state.position, scene.fluid


def test_rings_fill_a_disc_with_particles_of_equal_volume():
    space, position, _ = round_drop(40)
    radius = np.linalg.norm(position, axis=1)
    assert np.pi * radius.max() ** 2 < len(radius) * space.spacing**2
    assert len(radius) * space.spacing**2 == pytest.approx(np.pi, rel=2e-3)
    np.testing.assert_allclose(position.mean(axis=0), 0.0, atol=1e-12)


@pytest.mark.parametrize(("resolution", "tolerance"), [(30, 0.05), (60, 0.025)])
def test_surface_tension_pulls_a_drop_inward_by_its_curvature(resolution, tolerance):
    """Summed over a half, the pull is that of two cut ends: 2 sigma. First order in dx."""
    space, position, fluid = round_drop(resolution)
    _, rates = made((FreeSurface(), SurfaceTension(1.0)), space, position, fluid=fluid)
    pull = -np.asarray(rates.velocity)[np.asarray(position[:, 0]) > 0.0, 0].sum()
    assert space.spacing**2 * pull == pytest.approx(2.0, rel=tolerance)


def test_the_pressure_in_a_drop_balances_its_tension():
    space, position, fluid = round_drop(60)
    density = fluid.density(jnp.full(position.shape[0], 1.02))  # sigma over the mean of the radii
    effects = (FreeSurface(), SurfaceTension(1.0))
    _, tension = made(effects, space, position, density=density, fluid=fluid)
    _, both = made((*effects, PressureForce()), space, position, density=density, fluid=fluid)
    outer = np.linalg.norm(position, axis=1) > 0.9
    one = np.linalg.norm(tension.velocity, axis=1).max()
    # what is left is the spread of the curvature over the three rows that see the surface
    assert np.linalg.norm(both.velocity, axis=1)[outer].max() < 0.06 * one


@pytest.mark.parametrize(
    "effects",
    [
        (FreeSurface(), SurfaceTension(1.0)),
        (ParticleShifting(), FreeSurface(), SurfaceShifting()),
        (DensityDiffusion(0.1), FreeSurface(), SurfaceDiffusion()),
        (FreeSurface(), PressureForce(), TensileControl()),
    ],
    ids=["tension", "shifting", "diffusion", "tensile"],
)
def test_effects_of_the_surface_have_true_derivatives(effects):
    """In positions, by reverse mode, against central differences; a lone particle among them."""
    space, position, fluid = round_drop(12)
    lone = jnp.asarray([[1.7, 1.7]])
    position = jnp.concatenate([position * jnp.asarray([[1.05, 0.97]]), lone])
    density = 1.0 + 0.01 * jnp.sin(3.0 * position[:, 0] + position[:, 1])
    search = NeighborSearch.allocate(position, space.box, space.support, 0.1 * space.spacing)
    neighbors = search.build(position)
    functional = SPHFunctional(effects, fluid, space.spacing**2, space)
    weights = np.random.default_rng(1).normal(size=position.shape)

    @jax.jit
    def scalar(x):
        rates = functional(jnp.zeros(()), ParticleState(x, 0.0 * x, density), neighbors)
        total = jnp.sum(weights * (rates.velocity + rates.position))
        return total + jnp.sum(weights[:, 0] * rates.density)

    slope = np.asarray(jax.grad(scalar)(position))
    assert np.isfinite(slope).all()
    way = np.random.default_rng(2).normal(size=position.shape)
    step = 1e-6 * space.spacing
    central = (scalar(position + step * way) - scalar(position - step * way)) / (2.0 * step)
    assert float((slope * way).sum()) == pytest.approx(float(central), rel=1e-5)


def test_tensile_control_before_the_surface_is_refused():
    space, position = slab()
    with pytest.raises(ValueError, match="FreeSurface must stand before TensileControl"):
        made((PressureForce(), TensileControl(), FreeSurface()), space, position)


def test_an_effect_of_the_surface_without_its_fields_names_what_is_missing():
    scene = taylor_green(12, arrangement=Lattice())
    scene = dataclasses.replace(scene, effects=(*scene.effects, SurfaceShifting()))
    with pytest.raises(KeyError, match="surface_normal"):
        fields_of(scene)
