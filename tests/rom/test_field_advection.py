"""What f-bar does to the mean density: the drain, and its cures."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import ParticleState
from jaxsph.arrangements import JitteredLattice
from jaxsph.scenes import dam_break, taylor_green
from jaxsph.schemes import DeltaPlus
from jaxsph_rom import ConsistentAdvection, Gauged, ModeAdvection, PaperAdvection


@pytest.fixture(scope="module")
def disordered():
    """A scene in disorder, at uniform density, with its neighbours."""
    scene = taylor_green(16, arrangement=JitteredLattice(amplitude=0.2), scheme=DeltaPlus())
    density = jnp.broadcast_to(scene.fluid.reference_density, scene.state.density.shape)
    state = ParticleState(scene.state.position, scene.state.velocity, density)
    return scene, state, scene.search().build(state.position)


def rates(scene, state, neighbors, advection):
    """Rates by the effects of f-bar, and what is left of those of density without their mean."""
    functional = eqx.tree_at(
        lambda f: f.effects,
        scene.functional(),
        advection.eulerian(scene.effects),
        is_leaf=lambda x: isinstance(x, tuple),
    )
    found = eqx.filter_jit(functional)(jnp.zeros(()), state, neighbors)
    seen = jnp.concatenate([found.density[:, None], found.velocity], axis=1)
    still = advection.remaining(seen, state.density, lambda: jnp.zeros_like(seen))
    return found, float(scene.mass * jnp.sum(still[:, 0] / state.density))


def overlap(scene, position):
    """sum_ij V_i V_j W_ij [m^2]"""
    apart = position[None] - position[:, None]
    apart = apart - jnp.round(apart)
    squared = jnp.sum(apart**2, axis=-1) + jnp.eye(len(position))
    distance = jnp.where(squared < 1.0, jnp.sqrt(squared), 0.0) * (1.0 - jnp.eye(len(position)))
    kernel = scene.space.kernel.value(distance, scene.space.smoothing_length, 2)
    volume = scene.mass / scene.fluid.reference_density
    return volume**2 * jnp.sum(kernel)


def test_the_papers_advection_drains_density_by_what_shifting_does(disordered):
    scene, state, neighbors = disordered
    found, drained = rates(*disordered, PaperAdvection())
    shift = found.position - state.velocity

    @jax.jit
    def raised(velocity):  # 2 sum_i V_i a_i . g_i = dOmega/dt
        return jax.jvp(lambda x: overlap(scene, x), (state.position,), (velocity,))[1]

    density = float(scene.fluid.reference_density)
    assert drained == pytest.approx(density * float(raised(shift)), rel=1e-9)
    assert drained < 0.0
    size = float(scene.mass * jnp.sum(jnp.abs(found.density) / state.density))
    assert abs(drained) > 1e-2 * size  # no round-off
    whole = rates(*disordered, ModeAdvection())[1]
    assert whole == pytest.approx(density * float(raised(found.position)), rel=1e-9)
    for cured in (ConsistentAdvection(), Gauged(PaperAdvection()), Gauged(ModeAdvection())):
        np.testing.assert_allclose(rates(*disordered, cured)[1], 0.0, atol=1e-11 * size)


def test_a_gauge_is_refused_at_a_free_surface():
    with pytest.raises(ValueError, match="Gauged holds the mean .* take ModeAdvection"):
        Gauged(ModeAdvection()).eulerian(dam_break(10).effects)
