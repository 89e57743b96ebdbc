"""Small boxes of disordered particles, closed or periodic, in two and three dimensions."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import Box, BoxRegion, Fluid, ParticleState, Space, Walls
from jaxsph.arrangements import JitteredLattice, Lattice
from jaxsph.kernels import WendlandC2
from jaxsph.scenes import Scene
from jaxsph.schemes import Consistent

SOUND = 10.0


def vessel(side, dim=2, *, periodic=False, jitter=0.2, h_over_dx=2.0, kernel=None, scheme=None,
           viscosity=None, force=None, region=None, end_time=1.0, dtype=jnp.float64):  # fmt: skip
    """A box of `side` particles each way with dx = 1 m, c0 = 10 m/s, rho0 = 1 kg/m^3, at rest."""
    box = Box((0.0,) * dim, (float(side),) * dim, (periodic,) * dim)
    space = Space(box, kernel or WendlandC2(), h_over_dx, 1.0)
    rule = JitteredLattice(jitter, seed=3) if jitter else Lattice()
    position, walls = rule.positions(space), None
    if not periodic:
        region = region or BoxRegion(box.lower, box.upper)
        walls = Walls.around(region, space)
        inside = np.asarray(region.signed_distance(Lattice().positions(space))) < 0.0
        position = position[inside]
    scheme = Consistent() if scheme is None else scheme
    effects = scheme.effects(viscosity, force, None if periodic else region)
    state = ParticleState(position, 0.0 * position, jnp.ones(len(position)))
    limit = 1.0 if viscosity is None else max(1.0, 8.0 * viscosity / SOUND / h_over_dx)
    steps = max(1, round(end_time * SOUND / h_over_dx * limit))
    every = max(1, steps // 20)
    steps = every * -(-steps // every)
    scene = Scene("vessel", effects, Fluid(1.0, SOUND, 1.0), space, state, end_time / steps,
                  end_time, every, walls=walls)  # fmt: skip
    return jax.tree.map(lambda a: a.astype(dtype) if eqx.is_inexact_array(a) else a, scene)


def rates_of(scene):
    """state -> rates, with the neighbours of the scene's own start."""
    functional, neighbors = scene.functional(), scene.search().build(scene.state.position)
    time = jnp.zeros((), scene.state.density.dtype)
    return jax.jit(lambda state: functional(time, state, neighbors))


def disturbed(scene, seed=0, speed=0.3, density=0.03):
    """The scene's particles with random velocities and densities."""
    rng = np.random.default_rng(seed)
    shape = scene.state.position.shape
    kind = scene.state.density.dtype
    return ParticleState(
        scene.state.position,
        jnp.asarray(speed * rng.normal(size=shape), kind),
        jnp.asarray(1.0 + density * rng.normal(size=shape[0]), kind),
    )
