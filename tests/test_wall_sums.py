"""Sums over particles and ghosts against dense sums in numpy, and derivatives against differences.

Last, a whole functional with walls: reverse mode in state, viscosity and lid velocity.
"""

from functools import lru_cache, partial
from math import pi
from types import SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import (
    Box,
    Mirrored,
    Otherwise,
    PairTerm,
    ParticleState,
    Same,
    Space,
    VerletList,
    WallList,
    effects,
)
from jaxsph.arrangements import JitteredLattice
from jaxsph.effects import Context, LaminarViscosity
from jaxsph.kernels import WendlandC2
from jaxsph.neighbors import WallPairs
from jaxsph.scenes import lid_driven_cavity
from jaxsph.schemes import DeltaPlus
from jaxsph.wall_sums import ghost_sums, wall_sums

GRAVITY = effects.Gravity(jnp.asarray([0.0, -1.0]))
WITH_GHOSTS = (
    effects.Continuity(),
    effects.PressureForce(),
    effects.LaminarViscosity(0.01),
    effects.ParticleShifting(),
    effects.ShiftingTransport(),
)
GIVING = (GRAVITY, effects.WallPressure(), effects.NoSlip())
GHOST_TERMS = tuple(t for e in GIVING for t in e.ghost_terms(Context(None, None, None, None)))
CASES = {"2d": (2, 10), "3d": (3, 6)}
each_case = pytest.mark.parametrize("name", CASES)


def wall_terms(space):
    """All sums over ghosts, of both passes, as one pass."""
    context = Context(None, None, None, space)
    return tuple(t for e in WITH_GHOSTS for t in e.geometry_terms(context) + e.rate_terms(context))


class Case:
    """Jittered particles and ghosts in a channel that is periodic along its first axis."""

    def __init__(self, dim, side, seed=0):
        rng = np.random.default_rng(seed)
        dx = 1.0 / side
        box = Box((0.2, -1.0, 0.0)[:dim], (1.2, 0.0, 1.0)[:dim], (True,) + (False,) * (dim - 1))
        self.space = Space(box, WendlandC2(), 1.2 * dx, dx)
        ticks = [
            low + (np.arange(0 if k == 0 else -2, side + (0 if k == 0 else 2)) + 0.5) * dx
            for k, low in enumerate(box.lower)
        ]
        lattice = np.stack(np.meshgrid(*ticks, indexing="ij"), -1).reshape(-1, dim)
        lattice = lattice + 0.2 * dx * rng.uniform(-1.0, 1.0, lattice.shape)
        inside = np.all((lattice[:, 1:] > box.lower[1:]) & (lattice[:, 1:] < box.upper[1:]), axis=1)

        def fields(position):
            count = len(position)
            normal = rng.normal(size=(count, dim))
            density = 1.0 + 0.1 * rng.random(count)
            made = {
                "position": position,
                "velocity": rng.normal(size=(count, dim)),
                "density": density,
                "pressure": rng.normal(size=count),
                "volume": dx**dim / density,
                "shift_velocity": rng.normal(size=(count, dim)),
                "normal": normal / np.linalg.norm(normal, axis=1, keepdims=True),
            }
            return {name: jnp.asarray(value) for name, value in made.items()}

        self.fields, self.ghosts = fields(lattice[inside]), fields(lattice[~inside])
        del self.fields["normal"], self.ghosts["shift_velocity"]  # which each kind has not
        self.neighbors = make_list(
            self.space, *(f["position"] for f in (self.fields, self.ghosts)), 0.1 * dx
        )
        self.ghosts = {k: v[self.neighbors.wall.ghosts] for k, v in self.ghosts.items()}
        self.direction = {
            "position": jnp.asarray(dx * rng.normal(size=self.fields["position"].shape)),
            "velocity": jnp.asarray(rng.normal(size=self.fields["velocity"].shape)),
            "density": jnp.asarray(0.1 * rng.normal(size=self.fields["density"].shape)),
        }
        self.moved = {name: self.fields[name] for name in self.direction}

    def sums(self, moved, neighbors=None, terms=None):
        """All sums, in the particles' own order, where ghosts take velocity and pressure from them.

        Volume follows density, so that density counts as m / rho as well.
        """
        neighbors = self.neighbors if neighbors is None else neighbors
        volume = self.space.spacing**self.space.box.dim / moved["density"]
        fields = jax.tree.map(neighbors.sort, self.fields | moved | {"volume": volume})
        pairs, fixed = neighbors.wall, {k: self.ghosts[k] for k in ("position", "normal")}
        seen = ghost_sums(GHOST_TERMS, fields, fixed, self.space, pairs)
        weight = seen["ghost_weight"] + 1.0
        ghosts = self.ghosts | {
            "velocity": -seen["ghost_velocity"] / weight[:, None],
            "pressure": seen["ghost_pressure"] / weight,
        }
        terms = wall_terms(self.space) if terms is None else terms
        felt = wall_sums(terms, fields, ghosts, self.space, pairs)
        return seen, jax.tree.map(neighbors.unsort, felt)

    def along(self, step, direction):
        return {k: self.fields[k] + step * d for k, d in direction.items()}


def rows_of(flags, own, entry, slack=2):
    """Rows of a list, from which entries are near; free slots hold the row's own number."""
    capacity = max(row.sum() for row in flags) + slack
    index = np.repeat(own + np.arange(len(flags))[:, None], capacity, axis=1)
    for here, row in zip(index, flags, strict=True):
        here[: row.sum()] = entry + np.flatnonzero(row)
    return index


def make_list(space, position, ghosts, skin):
    """The list by brute force in numpy, in random orders, with free slots in each row."""
    count, rng = len(position), np.random.default_rng(7)
    order, ghost_order = rng.permutation(count), rng.permutation(len(ghosts))
    here, there = np.asarray(position)[order], np.asarray(ghosts)[ghost_order]
    across, among = (
        pairs_of(space, here, other, np.ones(len(other)))[1] < space.support + skin
        for other in (there, here)
    )
    np.fill_diagonal(among, False)
    seeing = np.flatnonzero(across.any(1))  # only these particles have rows
    across, near = across[seeing], len(seeing)
    upper, lower = rows_of(across, 0, near), rows_of(across.T, near, 0)
    capacity = max(upper.shape[1], lower.shape[1])
    upper, lower = (np.pad(a, ((0, 0), (0, capacity - a.shape[1])), "edge") for a in (upper, lower))
    order, ghost_order, seeing, index, own = (
        jnp.asarray(a, jnp.int32)
        for a in (order, ghost_order, seeing, np.concatenate([upper, lower]), rows_of(among, 0, 0))
    )
    zero = jnp.asarray(0, jnp.int32)
    fluid = VerletList(own, order, jnp.argsort(order), position, zero, zero)
    return WallList(fluid, WallPairs(index, seeing, ghost_order), jnp.asarray(False))


@lru_cache
def case(name):
    return Case(*CASES[name])


# ------------------------------------------------------------------ dense sums


def pairs_of(space, here, there, volume):
    """Separation, distance, W and grad_i W V_j of all pairs, (P, Q, ...), in numpy."""
    d = there[None] - here[:, None]
    length = np.asarray(space.box.lengths)
    d = d - np.where(space.box.periodic, length, 0.0) * np.round(d / length)
    r = np.sqrt((d**2).sum(-1))
    h, dim = space.smoothing_length, space.box.dim
    a = {2: 7.0 / (4.0 * pi), 3: 21.0 / (16.0 * pi)}[dim] / h**dim
    t = np.maximum(1.0 - 0.5 * r / h, 0.0)
    kernel = a * t**4 * (1.0 + 2.0 * r / h)
    gradient = (5.0 * a / h**2 * t**3 * volume[None, :])[..., None] * d
    return d, r, kernel, gradient


def numpy_fields(case):
    f = {k: np.asarray(v) for k, v in case.fields.items()}
    return f, {k: np.asarray(v) for k, v in case.ghosts.items()}


def dense_ghost_sums(case):
    f, g = numpy_fields(case)
    d, _, kernel, _ = pairs_of(case.space, g["position"], f["position"], f["volume"])
    return {
        "ghost_weight": kernel.sum(1),
        "ghost_pressure": (kernel * f["pressure"]).sum(1),
        "ghost_moment": -((kernel * f["density"])[..., None] * d).sum(1),
        "ghost_velocity": (kernel[..., None] * f["velocity"]).sum(1),
    }


def dense_wall_sums(case):
    f, g = numpy_fields(case)
    d, r, kernel, grad = pairs_of(case.space, f["position"], g["position"], g["volume"])
    origin = np.zeros((1, case.space.box.dim))
    at_spacing = pairs_of(
        case.space, origin, origin + case.space.spacing * np.eye(case.space.box.dim)[:1], np.ones(1)
    )[2]
    i, j = np.s_[:, None], np.s_[None, :]

    def mirrored(v):
        """A particle's vector, its part along the ghost's normal reversed, (N, G, n)."""
        along = np.einsum("ik,jk->ij", v, g["normal"])
        return v[i] - 2.0 * along[..., None] * g["normal"][j]

    u, du = f["velocity"], f["shift_velocity"]
    along_i, along_j = (du[i] * grad).sum(-1), (mirrored(du) * grad).sum(-1)
    approach = ((g["velocity"][j] - u[i]) * d).sum(-1) / r**2
    return {
        "shifting_sum": (((1.0 + 0.2 * kernel / at_spacing) ** 4)[..., None] * grad).sum(1),
        "velocity_divergence": ((mirrored(u) - u[i]) * grad).sum((1, 2)),
        "pressure_gradient": ((f["pressure"][i] + g["pressure"][j])[..., None] * grad).sum(1),
        "viscous_sum": (approach[..., None] * grad).sum(1),
        "shift_divergence": (along_j - along_i).sum(1),
        "shift_mass_flux": (g["density"][j] * along_j + f["density"][i] * along_i).sum(1),
        "shift_momentum_flux": (
            g["velocity"][j] * along_j[..., None] + u[i] * along_i[..., None]
        ).sum(1),
    }


@partial(jax.jit, static_argnums=(0, 1))
def both_sums(terms, space, fields, ghosts, neighbors):
    fields = jax.tree.map(neighbors.sort, fields)
    seen = ghost_sums(GHOST_TERMS, fields, {"position": ghosts["position"]}, space, neighbors.wall)
    felt = wall_sums(terms, fields, ghosts, space, neighbors.wall)
    return seen, jax.tree.map(neighbors.unsort, felt)


@each_case
def test_equal_dense_sums(name):
    one = case(name)
    seen, felt = both_sums(wall_terms(one.space), one.space, one.fields, one.ghosts, one.neighbors)
    for found, exact in ((seen, dense_ghost_sums(one)), (felt, dense_wall_sums(one))):
        assert found.keys() == exact.keys()
        for key, value in exact.items():
            size = np.abs(value).max()
            # round-off of some ten summands
            np.testing.assert_allclose(found[key], value, atol=1e-12 * size, err_msg=key)
    far = np.asarray(felt["shifting_sum"] == 0.0).all(1)
    assert 0.1 < far.mean() < 0.8, "there are particles out of reach of walls, too"


# ------------------------------------------------------------------ derivatives

STEP = 1e-5  # of a spacing: truncation 1e-10, round-off 1e-15 / 1e-5, kernels of order one


def inner(a, b):
    return sum(jnp.sum(x * y) for x, y in zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True))


def test_jvp_equals_central_differences_and_vjp_is_its_adjoint():
    one = case("2d")
    rng = np.random.default_rng(5)
    sums = jax.jit(one.sums)
    jvp = jax.jit(lambda m, t: jax.jvp(one.sums, (m,), (t,))[1])
    vjp = jax.jit(lambda m, w: jax.vjp(one.sums, m)[1](w)[0])
    value = sums(one.moved)
    weights = jax.tree.map(lambda s: jnp.asarray(rng.normal(size=s.shape)) / jnp.std(s), value)
    pulled = vjp(one.moved, weights)
    for part in ("position", "velocity", "density", "all"):
        direction = {
            k: d if part in (k, "all") else jnp.zeros_like(d) for k, d in one.direction.items()
        }
        tangent = jvp(one.moved, direction)
        forward, backward = (sums(one.along(s, direction)) for s in (STEP, -STEP))
        difference = jax.tree.map(lambda a, b: (a - b) / (2.0 * STEP), forward, backward)
        for t, exact, v in zip(*map(jax.tree.leaves, (tangent, difference, value)), strict=True):
            scale = jnp.max(jnp.abs(exact)) + 1e-3 * jnp.max(jnp.abs(v))
            np.testing.assert_allclose(t, exact, atol=1e-6 * float(scale))
        # round-off of sums over the same pairs in another order
        size = jnp.sqrt(inner(weights, weights) * inner(tangent, tangent))
        assert abs(inner(weights, tangent) - inner(pulled, direction)) < 1e-12 * size
        assert inner(pulled, direction) != 0.0


def test_vmap_equals_a_loop():
    """Of members with a list each."""
    one = case("2d")
    moved = [one.along(0.02 * k, one.direction) for k in range(3)]
    stacked = jax.tree.map(lambda *a: jnp.stack(a), *moved)
    lists = jax.tree.map(lambda a: jnp.stack([a] * 3), one.neighbors)

    def gradient(moved, neighbors):
        terms = effects.LaminarViscosity(0.01).rate_terms(None)
        return jax.grad(lambda m: inner(*[one.sums(m, neighbors, terms)] * 2))(moved)

    alone = jax.jit(gradient)
    loop = jax.tree.map(lambda *a: jnp.stack(a), *[alone(m, one.neighbors) for m in moved])
    mapped = jax.jit(jax.vmap(gradient))(stacked, lists)
    for a, b in zip(jax.tree.leaves(mapped), jax.tree.leaves(loop), strict=True):
        # the same sums, perhaps fused otherwise: a few units in the last place
        np.testing.assert_allclose(a, b, atol=1e-12 * float(jnp.max(jnp.abs(b))))


# ------------------------------------------------------------------ misuse


def test_what_no_effect_gives_the_ghosts_is_named():
    one = case("2d")
    fields = jax.tree.map(one.neighbors.sort, one.fields)
    for name in ("pressure", "velocity", "volume"):
        ghosts = {k: v for k, v in one.ghosts.items() if k != name}
        with pytest.raises(
            ValueError, match=f"ghosts of a scene with walls need {name}; list Wall"
        ):
            wall_sums(wall_terms(one.space), fields, ghosts, one.space, one.neighbors.wall)


def test_no_terms_no_sums_and_equal_terms_once():
    one = case("2d")
    arguments = (one.fields, one.ghosts, one.space, one.neighbors.wall)
    assert ghost_sums((), *arguments) == {} == wall_sums((), *arguments)
    first = PairTerm("same", ("pressure",), lambda pair, i, j: pair.kernel * i.pressure, Same())
    second = PairTerm("same", ("pressure",), lambda pair, i, j: pair.kernel, Same())
    assert jax.eval_shape(lambda: wall_sums((first, first), *arguments))["same"].shape == (100,)
    with pytest.raises(ValueError, match="terms: two different terms share a name"):
        wall_sums((first, second), *arguments)
    alone = PairTerm("alone", ("pressure",), lambda pair, i, j: pair.kernel * j.pressure)
    assert wall_sums((alone,), *arguments) == {}, "a term that says nothing of ghosts"
    nowhere = PairTerm("lost", ("temperature",), lambda pair, i, j: j.temperature * pair.kernel)
    with pytest.raises(ValueError, match="temperature"):
        ghost_sums((nowhere,), *arguments)


# ------------------------------------------------------------------ what a term does with ghosts


def jump_and_flux(pair, i, j):
    """(u_j - u_i) . g + (p_j u_j + p_i u_i) . g"""
    flux = j.velocity.dot(pair.gradient) * j.pressure + i.velocity.dot(pair.gradient) * i.pressure
    return (j.velocity - i.velocity).dot(pair.gradient) + flux


@pytest.mark.parametrize("wall", [None, "wall_velocity"], ids=["resting", "moving"])
def test_a_mirrored_vector_is_the_particles_own_reversed_at_the_wall(wall):
    """Against the same sum with the image written out as a vector, and its derivative."""
    one = case("2d")
    rng = np.random.default_rng(3)
    ghosts = one.ghosts | {
        "wall_velocity": jnp.asarray(rng.normal(size=(60, 2)))[: len(one.ghosts["volume"])]
    }

    def written_out(pair, i, j):
        slip = i.velocity - j.wall_velocity if wall else i.velocity
        image = i.velocity - j.normal * (2.0 * slip.dot(j.normal))
        return jump_and_flux(pair, i, SimpleNamespace(**vars(j) | {"velocity": image}))

    reads = ("velocity", "pressure")
    names = ("pressure", "normal", "wall_velocity")
    of = [
        PairTerm("found", reads, jump_and_flux, Mirrored("velocity", wall)),
        PairTerm("exact", reads, jump_and_flux, Otherwise(names, written_out)),
    ]
    fields = jax.tree.map(one.neighbors.sort, one.fields)

    def both(velocity):
        sums = wall_sums(
            tuple(of), fields | {"velocity": velocity}, ghosts, one.space, one.neighbors.wall
        )
        return sums["found"], sums["exact"]

    (found, exact), (moved, moves) = jax.jvp(
        both, (fields["velocity"],), (fields["velocity"][::-1],)
    )
    for a, b in ((found, exact), (moved, moves)):
        # round-off of some ten summands
        np.testing.assert_allclose(a, b, atol=1e-13 * float(jnp.max(jnp.abs(b))))
        assert float(jnp.max(jnp.abs(b))) > 0.1


# ------------------------------------------------------------------ a whole functional


def test_reverse_mode_of_a_walled_scene_equals_central_differences():
    """A scalar of all rates, differentiated in state, viscosity and lid velocity."""
    scene = lid_driven_cavity(12, arrangement=JitteredLattice(0.3), scheme=DeltaPlus())
    rng = np.random.default_rng(0)
    position = scene.state.position
    state = ParticleState(
        position,
        jnp.asarray(0.3 * rng.normal(size=position.shape)),
        jnp.asarray(1.0 + 0.005 * rng.normal(size=position.shape[0])),
    )
    dx = scene.space.spacing
    neighbors = make_list(scene.space, position, scene.walls.position, 0.01 * dx)
    functional = scene.functional()
    viscous = [isinstance(e, LaminarViscosity) for e in functional.effects].index(True)

    def parameters(f):
        return f.effects[viscous].viscosity, f.walls.velocity

    shapes = jax.eval_shape(lambda s: functional(jnp.asarray(0.0), s, neighbors), state)
    weights = jax.tree.map(lambda s: jnp.asarray(rng.normal(size=s.shape)), shapes)

    def scalar(inputs):
        state, viscosity, lid = inputs
        changed = eqx.tree_at(parameters, functional, (viscosity, lid))
        return inner(changed(jnp.asarray(0.0), state, neighbors), weights)

    inputs = (state, *parameters(functional))
    sizes = (ParticleState(dx, 1.0, 0.01), 0.01, 1.0)
    direction = jax.tree.map(
        lambda a, size: jnp.asarray(size * rng.normal(size=a.shape)), inputs, sizes
    )
    value = jax.jit(scalar)
    gradient = jax.jit(jax.grad(scalar))(inputs)
    names = ("position", "velocity", "density", "viscosity", "lid velocity")
    leaves, tree = jax.tree.flatten(direction)
    for k, name in enumerate(names):
        along = tree.unflatten([d if k == m else 0.0 * d for m, d in enumerate(leaves)])
        slope = inner(gradient, along)
        forward, backward = (
            value(jax.tree.map(lambda a, d, s=s: a + s * d, inputs, along)) for s in (1e-5, -1e-5)
        )
        difference = (forward - backward) / 2e-5
        # Truncation 1e-10 times kernels' third derivatives; round-off 1e-16 / 1e-5 of a value that
        # sums c0^2-sized forces of both signs.
        assert slope == pytest.approx(float(difference), rel=1e-6), name
        assert abs(slope) > 1e-6
