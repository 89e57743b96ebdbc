"""Which particles carry the projection, and which these see."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from jaxsph import FullModel, ParticleState, SPHFunctional
from jaxsph.compiled import full_precision
from jaxsph.neighbors import NeighborSearch, VerletList, WalledSearch, WallList
from jaxsph.scenes import Scene

from ..basis import Basis
from ..points.dynamics.rate_snapshots import rate_modes
from ..points.dynamics.sampling import Sampling
from ..points.dynamics.sampling.base import check_count
from .inputs import Inputs
from .label_basis import LabelBasis
from .learning import LabelRun, recover
from .products import products
from .sampled_system import SampledSystem, state_at

_RATES = 400  # states of all runs together at which rates are taken
_SEEN = 24  # of all runs at which samples are asked whom they see
_LEAST = 5  # of either in a run
_ENLARGEMENTS = 8  # of the neighbour list, each by a fifth
_SLACK = 0.1  # times dx: of the list's skin over what the runs need


def check_sampling(sampling: Sampling, scene: Scene) -> None:
    """Raise a ValueError if it is none, there are not so many particles, or walls move."""
    if not isinstance(sampling, Sampling):
        raise ValueError(f"sampling: a Sampling as QDEIM(16), got {sampling!r}.")
    check_count(sampling.samples, len(scene.state.position))
    if scene.walls is not None and scene.walls.bodies is not None:
        raise ValueError("sampling: walls that move have no samples yet; learn tensors instead.")


def sample(
    sampling: Sampling,
    models: Sequence[FullModel],
    runs: Sequence[LabelRun],
    labels: Float[np.ndarray, "particles dim"],
    motion: LabelBasis,
    density: LabelBasis,
    inputs: Inputs,
    interval: float,
) -> SampledSystem:
    """A `SampledSystem` of full runs in reduced coordinates.

    Rates of all particles, (dx/dt - u, du/dt), are taken at states that the reduced model will be
    in, b = (a, D m(a, p)) with a from the runs, and the `Sampling` chooses particles by these rates
    in the product of the modes of motion. Whom the samples see is told by the derivatives of their
    rates: all particles and ghosts of which one is not zero in one of the states.

    Args:
        sampling: as for rates at points.
        models: full models of the runs.
        runs: in reduced coordinates.
        labels: of all particles [m].
        motion, density: modes on all labels.
        inputs: p of the runs.
        interval: from snapshot to snapshot [s].

    Raises:
        ValueError: as `Sampling.choose` and `recover`, where particles bunch at states of the
            reduced model, or if they go so far that a periodic box is too small for a fixed list.
    """
    functional, size, (count, dim) = inputs.functional, runs[0].coordinates.shape[1], labels.shape
    recovery = jnp.asarray(recover(runs, inputs, interval), labels.dtype)
    whole = _Manifold(*jax.tree.map(jnp.asarray, (motion, density, labels)), recovery, inputs)
    found, roomy = [], []
    for model, run in zip(models, runs, strict=True):
        states = _some(run, interval, _RATES // len(runs))
        rates, model = _with_room(whole, model, *states)
        found.append(rates)
        roomy.append(model)
    scale, modes = (_by_particle(a, count, dim) for a in (motion.scale, motion.modes))
    ones = np.ones(2 * dim)
    rates = np.moveaxis(scale * np.concatenate([np.asarray(f) for f in found]), 0, -1)
    basis = Basis(modes[:, :, :size], np.zeros((1, 2 * dim)), ones, motion.singular_values)
    points, gather = sampling.choose(basis, rate_modes(rates, ones, functional.fluid))
    seen = [
        _seen_at(whole, model, jnp.asarray(points), *_some(run, interval, _SEEN // len(runs)))
        for model, run in zip(roomy, runs, strict=True)
    ]
    particles, ghosts, skin = (
        np.concatenate([np.asarray(getattr(each, name)) for each in seen]) for name in _Seen._fields
    )
    others = np.setdiff1d(np.flatnonzero(particles.any(axis=0)), points)
    members = np.concatenate([points, others])
    near = motion.at(members, 2, dim)
    middle = labels[members] + near.centre[: len(members) * dim].reshape(-1, dim)
    held = np.flatnonzero(ghosts.any(axis=0))
    held = held if len(held) else np.zeros(1, int)  # a list has one ghost at least
    functional, neighbors = _around(functional, middle, held, float(skin.max()))
    first, half = motion.modes[:, :size] * motion.scale[:, None], count * dim
    velocity = motion.modes[half:] / motion.scale[half:, None]
    reals = partial(jnp.asarray, dtype=labels.dtype)
    return SampledSystem(
        motion=jax.tree.map(reals, near),
        density=jax.tree.map(reals, density.at(members, 1, 1)),
        labels=reals(labels[members]),
        neighbors=neighbors,
        carried=reals(first[:half].T @ velocity),
        carried_centre=reals(first[:half].T @ motion.centre[half:]),
        gather=reals(gather * scale[points]),
        recovery=recovery,
        inputs=eqx.tree_at(lambda i: i.functional, inputs, functional),
    )


def _by_particle(numbers, count: int, dim: int):
    """Numbers of motion, displacements and velocities behind one another, a row a particle."""
    parts = np.moveaxis(numbers.reshape(2, count, dim, *numbers.shape[1:]), 0, 1)
    return parts.reshape(count, 2 * dim, *numbers.shape[1:])


def _some(run: LabelRun, interval: float, wanted: int):
    """Times, coordinates and theta of some of a run's snapshots, from the first to the last."""
    count, dtype = len(run.coordinates), run.coordinates.dtype
    chosen = np.linspace(0, count - 1, min(count, max(wanted, _LEAST))).round().astype(int)
    parts = (interval * chosen, run.coordinates[chosen], run.values)
    return tuple(jnp.asarray(a, dtype) for a in parts)


def _around(
    functional: SPHFunctional,
    position: Float[np.ndarray, "members dim"],
    ghosts: Int[np.ndarray, " seen"],
    skin: float,
) -> tuple[SPHFunctional, VerletList | WallList]:
    """The functional with the ghosts that are seen alone, and the list about the places given."""
    space, walls, position = functional.space, functional.walls, jnp.asarray(position)
    wide = (space.box, space.support, skin + _SLACK * space.spacing)
    if walls is None:
        return functional, NeighborSearch.allocate(position, *wide, margin=1.0).build(position)
    rows = [a[ghosts] for a in (walls.position, walls.normal, walls.velocity)]
    walls = eqx.tree_at(lambda w: (w.position, w.normal, w.velocity), walls, rows)
    search = WalledSearch.allocate(position, rows[0], *wide, space.spacing, margin=1.0)
    return eqx.tree_at(lambda f: f.walls, functional, walls), search.build(position)


class _Manifold(eqx.Module):
    """The state of all particles at a few coordinates."""

    motion: LabelBasis
    density: LabelBasis
    labels: Float[Array, "particles dim"]
    recovery: Float[Array, "recovered products"]
    inputs: Inputs

    def state(self, time, coordinates, values) -> ParticleState:
        others = self.recovery @ products(coordinates, self.inputs(time, values))
        more = self.motion.size - coordinates.shape[0]
        b = jnp.concatenate([coordinates, others[:more]])
        return state_at(self.motion, self.density, self.labels, b, others[more:])


def _with_room(whole, model: FullModel, *states):
    """Rates of a model whose lists have room at all states, and that model."""
    for _ in range(_ENLARGEMENTS):
        found, overflow = _rates_at(whole, model, *states)
        if not overflow:
            return found, model
        model = model.enlarged()
    raise ValueError(
        "modes: at states of the reduced model particles bunch beyond all room of the neighbour "
        "list; take more recovered modes, or other runs."
    )


@eqx.filter_jit
@full_precision
def _rates_at(
    whole, model, times, coordinates, values
) -> tuple[Float[Array, "states particles fields"], Bool[Array, ""]]:
    """(dx/dt - u, du/dt) of all particles, and whether a list had no room."""

    def at(moment):
        state = whole.state(*moment, values)
        neighbors = model.prepare(state)
        found = model.functional(moment[0], state, neighbors)
        rates = jnp.concatenate([found.position - state.velocity, found.velocity], axis=1)
        return rates, neighbors.overflow

    rates, overflow = lax.map(at, (times, coordinates))
    return rates, jnp.any(overflow)


class _Seen(NamedTuple):
    """What moves the samples' rates in some states, and by how much more than the kernel's support
    particles within it are apart about the middle of their motion [m], at most."""

    particles: Bool[Array, "states particles"]
    ghosts: Bool[Array, "states ghosts"]
    skin: Float[Array, " states"]


@eqx.filter_jit
@full_precision
def _seen_at(whole, model, points, times, coordinates, values) -> _Seen:
    functional = model.functional
    shape, walls = whole.labels.shape, functional.walls
    ghosts = jnp.zeros((0, shape[1]), whole.labels.dtype) if walls is None else walls.position
    middle = whole.labels + whole.motion.centre[: whole.labels.size].reshape(shape)
    # sums in which no derivative is lost but by chance
    weights = jax.random.normal(jax.random.key(0), (2, len(points), shape[1]), middle.dtype)

    def at(moment):
        state = whole.state(*moment, values)
        neighbors = model.prepare(state)

        def rates(state, ghosts):
            there = functional
            if walls is not None:
                there = eqx.tree_at(lambda f: f.walls.position, functional, ghosts)
            found = there(moment[0], state, neighbors)
            return jnp.sum(weights * jnp.stack([found.position[points], found.velocity[points]]))

        slopes, of_ghosts = jax.grad(rates, argnums=(0, 1))(state, ghosts)
        rows = [slope.reshape(shape[0], -1) for slope in jax.tree.leaves(slopes)]
        particles = jnp.any(jnp.concatenate(rows, axis=1) != 0.0, axis=1)
        skin = _parted(functional.space, neighbors, state.position, middle, ghosts)
        return _Seen(particles, jnp.any(of_ghosts != 0.0, axis=1), skin)

    return lax.map(at, (times, coordinates))


def _parted(space, neighbors, position, middle, ghosts) -> Float[Array, ""]:
    """The most by which pairs within the support are beyond it about the middle of motion [m]."""
    fluid, x, rest = neighbors, neighbors.sort(position), neighbors.sort(middle)
    pairs = []
    if isinstance(neighbors, WallList):
        fluid, wall, seen = neighbors.fluid, neighbors.wall, ghosts[neighbors.wall.ghosts]
        rows = (wall.table(wall.of_near(places), seen) for places in (x, rest))
        pairs.append((*rows, wall.index))
    pairs.append((x, rest, fluid.index))
    farthest = jnp.zeros((), position.dtype)
    for now, then, index in pairs:
        near, apart = (_distance(space, places, index) for places in (now, then))
        beyond = jnp.where(near < space.support, apart - space.support, 0.0)
        farthest = jnp.maximum(farthest, jnp.max(beyond))
    return farthest


def _distance(space, places, index) -> Float[Array, "rows capacity"]:
    way = space.box.displacement(places[:, None, :], places[index])
    return jnp.sqrt(jnp.sum(way * way, axis=2))
