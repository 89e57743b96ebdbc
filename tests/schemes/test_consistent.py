"""What the consistent scheme is exact for, what it conserves, and its derivatives."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import BoxRegion, MovingBody, ParticleState, run_scene
from jaxsph.effects import (
    ConsistentViscosity,
    FreeSurface,
    Gravity,
    KernelCorrection,
    StrainShifting,
)
from jaxsph.kernels import WendlandC4
from jaxsph.scenes import SCENES, taylor_green
from jaxsph.scenes import taylor_green_solution as exact
from jaxsph.scenes.record import scene_from_record
from jaxsph.schemes import Consistent, DeltaPlus
from jaxsph.walls import Walls

from .vessels import disturbed, rates_of, vessel


def test_a_uniform_motion_has_no_rates():
    scene = vessel(12, periodic=True, viscosity=0.1)
    moved = jnp.zeros_like(scene.state.velocity) + jnp.asarray([[0.7, -0.4]])
    found = rates_of(scene)(dataclasses.replace(scene.state, velocity=moved))
    np.testing.assert_allclose(found.velocity, 0.0, atol=1e-13)
    np.testing.assert_allclose(found.density, 0.0, atol=1e-13)
    np.testing.assert_allclose(found.position, moved, atol=1e-13)


def test_total_momentum_is_kept_by_pressure():
    scene = vessel(12, periodic=True)
    still = dataclasses.replace(disturbed(scene), velocity=scene.state.velocity)
    found = rates_of(scene)(still).velocity
    np.testing.assert_allclose(found.sum(axis=0), 0.0, atol=1e-12 * float(jnp.abs(found).sum()))


def test_a_rigid_rotation_is_not_shifted_and_feels_no_viscosity():
    scene = vessel(24, periodic=True)
    offset = scene.state.position - 12.0
    spin = 0.1 * jnp.stack([-offset[:, 1], offset[:, 0]], axis=1)
    effects = (KernelCorrection(), ConsistentViscosity(1.0), StrainShifting())
    scene = dataclasses.replace(scene, effects=effects)
    found = rates_of(scene)(dataclasses.replace(scene.state, velocity=spin))
    inside = np.asarray(jnp.abs(offset).max(axis=1) < 4.0)  # the jump at the faces is not seen
    np.testing.assert_allclose(found.position[inside], spin[inside], atol=1e-13)
    np.testing.assert_allclose(found.velocity[inside], 0.0, atol=1e-12)


@pytest.mark.parametrize("options", [dict(side=12, periodic=True), dict(side=7)], ids=str)
@pytest.mark.run_once
def test_derivatives_of_the_rates(options):
    scene = vessel(viscosity=0.05, force=Gravity(jnp.asarray([0.1, -0.3])), **options)
    functional, neighbors = scene.functional(), scene.search().build(scene.state.position)
    state, rng = disturbed(scene, speed=0.1), np.random.default_rng(5)
    ways = jax.tree.map(lambda a: jnp.asarray(rng.normal(size=a.shape)), state)
    weights = jax.tree.map(lambda a: jnp.asarray(rng.normal(size=a.shape)), state)

    @jax.jit
    def measured(state, viscosity):
        changed = functional.with_effect(ConsistentViscosity(viscosity))
        found = changed(jnp.zeros(()), state, neighbors)
        return sum(jnp.sum(a * b) for a, b in zip(
            jax.tree.leaves(found), jax.tree.leaves(weights), strict=True))  # fmt: skip

    def along(step):
        moved = jax.tree.map(lambda a, b: a + step * b, state, ways)
        return measured(moved, 0.05 + 0.1 * step)

    step = 1e-6
    difference = float(along(step) - along(-step)) / (2.0 * step)
    forward = float(jax.jvp(along, (0.0,), (1.0,))[1])
    slopes, slope = jax.grad(measured, argnums=(0, 1))(state, 0.05)
    pairs = zip(jax.tree.leaves(slopes), jax.tree.leaves(ways), strict=True)
    reverse = float(sum(jnp.sum(a * b) for a, b in pairs) + 0.1 * slope)
    assert forward == pytest.approx(difference, rel=1e-6)
    assert reverse == pytest.approx(forward, rel=1e-10)


def test_at_rest_every_derivative_is_finite():
    scene = vessel(7, viscosity=0.05)
    found = rates_of(scene)
    slope = jax.grad(lambda state: jnp.sum(found(state).velocity ** 2))(scene.state)
    assert all(bool(jnp.isfinite(leaf).all()) for leaf in jax.tree.leaves(slope))


def vortex_errors(scheme, side=25):
    """Relative errors of velocity and pressure at 0.5 s, Re = 100."""
    run = run_scene(taylor_green(side, 100.0, end_time=0.5, scheme=scheme))
    position, time = run.position[-1], float(run.time[-1])
    velocity = np.asarray(exact.velocity(position, time, 0.01))
    pressure = np.asarray(exact.pressure(position, time, 0.01, 1000.0))
    pairs = (run.velocity[-1], velocity), (run.pressure[-1] - run.pressure[-1].mean(), pressure)
    return [np.linalg.norm(a - b) / np.linalg.norm(b) for a, b in pairs]


def test_a_vortex_is_several_times_as_accurate_as_by_the_paper_s_scheme():
    new, old = vortex_errors(Consistent()), vortex_errors(DeltaPlus())
    assert new[0] < 0.004 and new[0] < 0.4 * old[0]
    assert new[1] < 0.12 and new[1] < 0.4 * old[1]


@pytest.mark.parametrize("name", ["taylor-green", "lid-driven-cavity", "poiseuille"])
def test_a_record_remembers_the_scheme(name):
    scene = SCENES[name](20, scheme=Consistent())
    again = scene_from_record(name, scene.parameters)
    assert [e.name for e in again.effects] == [e.name for e in scene.effects]
    older = {key: value for key, value in scene.parameters.items() if key != "scheme"}
    assert scene_from_record(name, older).effects[0].name == "Continuity"


def test_bodies_that_are_moved_are_refused():
    scene = vessel(22, viscosity=0.1)
    body = MovingBody(BoxRegion((6.0, 6.0), (16.0, 16.0)), lambda t: jnp.stack([0.1 * t, 0.0 * t]))
    region = BoxRegion((0.0, 0.0), (22.0, 22.0))
    walls = Walls.around(region, scene.space, bodies=(body,))
    keep = np.asarray(walls.start_region.signed_distance(scene.state.position)) < -0.3
    start = ParticleState(*(a[keep] for a in jax.tree.leaves(scene.state)))
    moved = dataclasses.replace(scene, walls=walls, state=start)
    with pytest.raises(ValueError, match="Continuity and PressureForce"):
        run_scene(moved)


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        (lambda all: all[1:], "AdjointPressure needs KernelCorrection before it"),
        (lambda all: (*all[:3], *all[4:]), "ConsistentTransport needs DensityDiffusion before it"),
        (lambda all: (FreeSurface(), *all), "for a fluid that fills its box"),
    ],
    ids=["no correction", "no diffusion", "a free surface"],
)
def test_effects_that_do_not_fit_are_refused_by_name(effects, message):
    scene = vessel(12, periodic=True, viscosity=0.1)
    scene = dataclasses.replace(scene, effects=effects(scene.effects))
    with pytest.raises(ValueError, match=message):
        rates_of(scene)(scene.state)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_kernel_too_narrow_for_the_viscous_weight_is_refused_when_the_scene_is_made(dim):
    options = dict(side=12, dim=dim, periodic=True, viscosity=0.1, kernel=WendlandC4())
    with pytest.raises(ValueError, match="h_over_dx: 1 leaves WendlandC4 too few neighbours"):
        vessel(h_over_dx=1.0, **options)
    vessel(h_over_dx=1.25, **options)
