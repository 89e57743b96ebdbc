"""Coefficients that operators leave open: tensors at unseen ones are those of the scene there."""

import dataclasses
from functools import cache

import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float

from jaxsph import Fluid
from jaxsph.arrangements import Lattice
from jaxsph.effects import DensityDiffusion, Effect, Gravity, LaminarViscosity
from jaxsph.scenes import lid_driven_cavity, taylor_green
from jaxsph.schemes import DeltaPlus
from jaxsph_rom import Energy, pod
from jaxsph_rom.points import Coefficients, EulerianRates, ReferenceOperators
from jaxsph_rom.points.dynamics.fixed_points import on_points
from jaxsph_rom.points.dynamics.opened import Opened
from jaxsph_rom.points.dynamics.quadratic_system import projected


class Pull(Effect):
    """A uniform force that ghosts do not know: their density would go with force / c0^2."""

    vector: Float[Array, " dim"]

    def rates(self, context, fields, sums):
        return {"velocity": jnp.broadcast_to(self.vector, fields["velocity"].shape)}


@cache
def cavity():
    return lid_driven_cavity(12, 100.0, scheme=DeltaPlus())


def scene_of(viscosity, sound, lid, pull, delta=0.1, kind=Pull):
    """A cavity whose viscosity, speed of sound, lid, force and diffusion are anything."""
    first = cavity()
    changed = {
        "LaminarViscosity": LaminarViscosity(viscosity),
        "DensityDiffusion": DensityDiffusion(delta),
    }
    effects = [changed.get(e.name, e) for e in first.effects]
    walls = dataclasses.replace(first.walls, velocity=lid * first.walls.velocity)
    fluid = Fluid(first.fluid.reference_density, sound, first.fluid.reference_speed)
    force = kind(jnp.asarray([pull, -2.0 * pull]))
    return dataclasses.replace(first, effects=(*effects, force), walls=walls, fluid=fluid)


SCENES = [
    (0.01, 10.0, 1.0, 0.5, 0.1), (0.02, 12.0, 0.5, 0.2, 0.1), (0.03, 9.0, 0.7, 0.9, 0.2),
    (0.015, 11.0, 0.3, 0.1, 0.15),
]  # fmt: skip


def test_tensors_at_unseen_coefficients_are_the_scenes_own():
    scenes = [scene_of(*values) for values in SCENES]
    functionals = [on_points(scene) for scene in scenes]
    coefficients = Coefficients.between(functionals)
    assert coefficients.size == 5
    points = scenes[0].state.position
    operators = ReferenceOperators.of_scene(scenes[0], points, coefficients)
    opened = Opened.found(operators, [np.asarray(coefficients.values(f)) for f in functionals])
    names = coefficients.names
    bends = {
        frozenset(names[k].split(".")[-1] for k in np.flatnonzero(powers))
        for powers in opened.powers
        if sum(powers) == 2
    }
    wanted = [{"sound_speed"}, {"sound_speed", "delta"}, {"viscosity", "velocity"}]
    assert bends == set(map(frozenset, wanted))  # c0^2, delta c0, and what the lid drags along
    snapshots = np.random.default_rng(0).normal(size=(len(points), 3, 8))
    snapshots[:, 0] = 1.0 + 0.01 * snapshots[:, 0]
    basis = pod(snapshots, Energy(), scenes[0].fluid, 4)
    system = projected(operators, basis, opened=opened)
    unseen = scene_of(0.05, 14.0, 2.0, -3.0, 0.05)
    functional = on_points(unseen)
    coefficients.check(functional, functionals[0], "parameters")
    own = projected(ReferenceOperators.of(functional, points), basis)
    a = jnp.asarray(np.random.default_rng(1).normal(size=4))
    wanted = own(a, jnp.zeros(0))
    found = system(a, coefficients.values(functional))
    # advection by modes has a part of the lid's speed times the change of a ghost's volume, which
    # is taken at the middle: some 1e-6 of all
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-5 * float(jnp.abs(wanted).max()))
    still = dataclasses.replace(system, quadratic=own.quadratic)
    found = still(a, coefficients.values(functional))
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-11 * float(jnp.abs(wanted).max()))


def test_ghosts_under_a_force_are_no_polynomial_of_the_sound_speed():
    scenes = [scene_of(*values, kind=Gravity) for values in SCENES]
    functionals = [on_points(scene) for scene in scenes]
    coefficients = Coefficients.between(functionals)
    operators = ReferenceOperators.of_scene(scenes[0], scenes[0].state.position, coefficients)
    with pytest.raises(ValueError, match="make: .* fluid.sound_speed"):
        Opened.found(operators, [np.asarray(coefficients.values(f)) for f in functionals])


def test_an_array_that_training_does_not_span_is_named():
    scenes = [taylor_green(12, arrangement=Lattice()) for _ in range(2)]
    pulls = [jnp.asarray([f, 0.0]) for f in (0.5, 1.0)]
    scenes = [
        dataclasses.replace(scene, effects=(*scene.effects, Gravity(pull)))
        for scene, pull in zip(scenes, pulls, strict=True)
    ]
    functionals = [on_points(scene) for scene in scenes]
    coefficients = Coefficients.between(functionals)
    assert coefficients.size == 1
    turned = dataclasses.replace(
        scenes[0], effects=(*scenes[0].effects[:-1], Gravity(jnp.asarray([0.0, 1.0])))
    )
    with pytest.raises(ValueError, match="parameters: the scene's .*vector is none"):
        coefficients.check(on_points(turned), functionals[0], "parameters")


def test_rates_at_samples_keep_their_ghosts_coefficients():
    scenes = [scene_of(0.01, 10.0, lid, 0.5) for lid in (0.5, 1.0)]
    coefficients = Coefficients.between([on_points(scene) for scene in scenes])
    points = scenes[0].state.position
    rates = EulerianRates.of_scene(scenes[0], points, coefficients)
    samples = np.array([0, 70, len(points) - 1])
    around, members = rates.around(samples)
    fields = np.zeros((len(points), 3))
    fields[:, 0] = 1.0
    values = 2.0 * coefficients.values(on_points(scenes[1]))
    whole = rates(jnp.zeros(()), jnp.asarray(fields), values)
    part = around(jnp.zeros(()), jnp.asarray(fields[members]), values)
    np.testing.assert_allclose(part[:3], whole[samples], atol=1e-12 * np.abs(whole).max())
    assert float(jnp.abs(whole[samples]).max()) > 0.0  # the lid drags at a corner
