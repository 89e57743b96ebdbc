"""The functional holds the sums of its effects and no others; coefficients are data."""

import re

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import ParticleState, SPHFunctional
from jaxsph.arrangements import JitteredLattice
from jaxsph.effects import (
    Continuity,
    DensityDiffusion,
    LaminarViscosity,
    ParticleShifting,
    PressureForce,
    ShiftingTransport,
)
from jaxsph.scenes import taylor_green
from jaxsph.schemes import DeltaPlus

SCOPES = {  # each effect's own scope and those of its sums
    Continuity: {"Continuity", "velocity_divergence"},
    PressureForce: {"PressureForce", "pressure_gradient"},
    LaminarViscosity: {"LaminarViscosity", "viscous_sum"},
    DensityDiffusion: {
        "DensityDiffusion",
        "renormalisation",
        "raw_density_gradient",
        "diffusion_sum",
    },
    ParticleShifting: {"ParticleShifting", "shifting_sum"},
    ShiftingTransport: {
        "ShiftingTransport",
        "shift_divergence",
        "shift_mass_flux",
        "shift_momentum_flux",
    },
}
BARE = (Continuity, PressureForce)
SUBSETS = [
    BARE,
    (Continuity, PressureForce, LaminarViscosity),
    (Continuity, DensityDiffusion),
    (ParticleShifting,),
    (PressureForce, ParticleShifting, ShiftingTransport),
    tuple(SCOPES),
]


@pytest.fixture(scope="module")
def scene():
    return taylor_green(12, arrangement=JitteredLattice(), scheme=DeltaPlus())


@pytest.fixture(scope="module")
def neighbors(scene):
    return scene.search().build(scene.state.position)


def with_effects(scene, kinds) -> SPHFunctional:
    effects = tuple(e for e in scene.effects if isinstance(e, kinds))
    assert len(effects) == len(kinds)
    return eqx.tree_at(lambda s: s.effects, scene, effects).functional()


def compiled(functional, state, neighbors):
    dynamic, static = eqx.partition(functional, eqx.is_array)

    def rates(dynamic, time, state, neighbors):
        return eqx.combine(dynamic, static)(time, state, neighbors)

    return jax.jit(rates).lower(dynamic, jnp.asarray(0.0), state, neighbors).compile()


def scopes(program) -> set[str]:
    """All words of all operation names in a compiled program."""
    names = re.findall(r'op_name="([^"]*)"', program.as_text())
    return {word for name in names for word in re.split(r"[/()]", name)}


@pytest.mark.parametrize("kinds", SUBSETS, ids=lambda k: "+".join(c.__name__ for c in k))
def test_an_absent_effect_is_not_in_the_compiled_program(scene, neighbors, kinds):
    found = scopes(compiled(with_effects(scene, kinds), scene.state, neighbors))
    every = set().union(*SCOPES.values())
    assert found & every == set().union(*(SCOPES[kind] for kind in kinds))
    has_first_pass = any(k in kinds for k in (DensityDiffusion, ParticleShifting))
    assert ("geometry_pass" in found) == has_first_pass


def test_fewer_effects_cost_fewer_operations(scene, neighbors):
    def cost(kinds):
        return compiled(with_effects(scene, kinds), scene.state, neighbors).cost_analysis()["flops"]

    bare, viscous, full = cost(BARE), cost((*BARE, LaminarViscosity)), cost(tuple(SCOPES))
    assert 0.0 < bare < viscous < full
    # one pass of two sums against two passes of ten
    assert full > 2.0 * bare


def test_rates_are_the_sum_of_the_effects(scene, neighbors):
    def rates(kinds):
        functional = with_effects(scene, kinds)
        return eqx.filter_jit(functional)(jnp.asarray(0.0), scene.state, neighbors)

    # ShiftingTransport needs ParticleShifting's field, so these two come together
    parts = [(Continuity,), (PressureForce,), (LaminarViscosity,), (DensityDiffusion,)]
    parts += [(ParticleShifting, ShiftingTransport)]
    found = [rates(kinds) for kinds in parts]
    whole = rates(tuple(SCOPES))
    for name in ("velocity", "density"):
        total = sum(getattr(r, name) for r in found)
        size = float(jnp.max(jnp.abs(total)))
        np.testing.assert_allclose(getattr(whole, name), total, atol=1e-13 * size)  # round-off
    # every part moves particles with their velocity already
    shift = sum(r.position - scene.state.velocity for r in found)
    np.testing.assert_allclose(whole.position, scene.state.velocity + shift, atol=1e-14)


def test_without_effects_particles_fly_straight(scene, neighbors):
    rates = SPHFunctional((), scene.fluid, scene.mass, scene.space)(
        jnp.asarray(0.0), scene.state, neighbors
    )
    np.testing.assert_array_equal(rates.position, scene.state.velocity)
    np.testing.assert_array_equal(rates.velocity, jnp.zeros_like(rates.velocity))
    np.testing.assert_array_equal(rates.density, jnp.zeros_like(rates.density))


def test_transport_without_shifting_says_what_is_missing(scene, neighbors):
    functional = with_effects(scene, (ShiftingTransport,))
    with pytest.raises(ValueError, match="shift_velocity"):
        functional(jnp.asarray(0.0), scene.state, neighbors)


def test_new_coefficients_do_not_recompile(scene, neighbors):
    traces = []

    @eqx.filter_jit
    def rates(functional, state, neighbors):
        traces.append(1)
        return functional(jnp.asarray(0.0), state, neighbors)

    functional = scene.functional()
    kinds = [type(e) for e in functional.effects]
    viscous, diffusive = kinds.index(LaminarViscosity), kinds.index(DensityDiffusion)
    first = rates(functional, scene.state, neighbors)
    for where, value, field in (
        (lambda f: f.effects[viscous].viscosity, 0.5, "velocity"),
        (lambda f: f.effects[diffusive].delta, 0.2, "density"),
        (lambda f: f.fluid.sound_speed, 20.0, "velocity"),
        (lambda f: f.fluid.reference_density, 999.0, "velocity"),
        (lambda f: f.fluid.reference_speed, 2.0, "position"),
        (lambda f: f.mass, 7.0, "velocity"),
    ):
        changed = eqx.tree_at(where, functional, jnp.asarray(value, jnp.float64))
        moved = getattr(rates(changed, scene.state, neighbors), field)
        assert float(jnp.max(jnp.abs(moved - getattr(first, field)))) > 0.0, "it does count"
    # a scene made anew with other parameters runs in the same program, too
    other = taylor_green(12, 50.0, arrangement=JitteredLattice(), scheme=DeltaPlus())
    rates(other.functional(), other.state, neighbors)
    assert len(traces) == 1
    rates(with_effects(scene, BARE), scene.state, neighbors)
    assert len(traces) == 2, "the count can count: other effects are another program"


def test_coefficients_differentiate(scene, neighbors):
    """The viscous term is linear in viscosity: its derivative is the term over the coefficient."""

    def velocity_rate(viscosity):
        functional = SPHFunctional(
            (LaminarViscosity(viscosity),), scene.fluid, scene.mass, scene.space
        )
        return functional(jnp.asarray(0.0), scene.state, neighbors).velocity

    at = jnp.asarray(0.01)
    rate, slope = jax.jit(lambda v: jax.jvp(velocity_rate, (v,), (jnp.ones_like(v),)))(at)
    np.testing.assert_allclose(slope * at, rate, rtol=1e-13)  # round-off
    backward = jax.jit(jax.grad(lambda v: jnp.sum(velocity_rate(v) * rate)))(at)
    np.testing.assert_allclose(backward, jnp.sum(slope * rate), rtol=1e-12)  # round-off


@pytest.mark.parametrize("dtype", [jnp.float32, jnp.float64])
def test_dtype_follows_the_state(dtype):
    scene = taylor_green(12, arrangement=JitteredLattice(), scheme=DeltaPlus(), dtype=dtype)
    neighbors = scene.search().build(scene.state.position)
    rates = eqx.filter_jit(scene.functional())(jnp.asarray(0.0, dtype), scene.state, neighbors)
    for leaf in jax.tree.leaves((scene.state, rates)):
        assert leaf.dtype == dtype
    if dtype == jnp.float32:
        double = ParticleState(*(a.astype(jnp.float64) for a in jax.tree.leaves(scene.state)))
        reference = taylor_green(12, arrangement=JitteredLattice(), scheme=DeltaPlus())
        exact = eqx.filter_jit(reference.functional())(jnp.asarray(0.0), double, neighbors)
        for found, value in zip(jax.tree.leaves(rates), jax.tree.leaves(exact), strict=True):
            size = float(jnp.max(jnp.abs(value)))
            # 3e-6 measured: rho - rho0 of order 5 is rounded to 3e-5, and both lists are the same
            np.testing.assert_allclose(found.astype(jnp.float64), value, atol=2e-5 * size)
