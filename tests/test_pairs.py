"""The pair sum against dense sums in numpy, and all its derivatives against differences."""

from functools import partial
from math import pi

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.extend.core import jaxprs_in_params

from jaxsph import COMPILER_OPTIONS, Box, PairTerm, Space, VerletList, effects, pair_sum
from jaxsph.kernels import QuinticSpline, WendlandC2, WendlandC4
from jaxsph.pairs import pair_sum_p

SKIN = 0.1  # times dx: room for the steps of differences
EFFECTS = (
    effects.Continuity(),
    effects.PressureForce(),
    effects.LaminarViscosity(0.01),
    effects.DensityDiffusion(0.1),
    effects.ParticleShifting(),
    effects.ShiftingTransport(),
)


def delta_plus_terms(space):
    """All ten sums of delta-plus-SPH, of both passes, as one pass."""
    context = effects.Context(None, None, None, space)
    return tuple(t for e in EFFECTS for t in e.geometry_terms(context) + e.rate_terms(context))


def make_space(dim, side, kernel=None, h_over_dx=1.1):
    kernel = WendlandC2() if kernel is None else kernel
    box = Box((0.0, -1.0, 0.2)[:dim], (1.0, 0.0, 1.2)[:dim], (True,) * dim)
    return Space(box, kernel, h_over_dx / side, 1.0 / side)


def make_fields(space, seed=0, dtype=jnp.float64):
    """A jittered lattice with random fields, in the particles' own order."""
    rng = np.random.default_rng(seed)
    dim, side = space.box.dim, round(1.0 / space.spacing)
    lattice = (np.stack(np.meshgrid(*[np.arange(side)] * dim), -1).reshape(-1, dim) + 0.5) / side
    count = len(lattice)
    jitter = 0.3 * space.spacing * rng.uniform(-1.0, 1.0, (count, dim))
    density = 1.0 + 0.1 * rng.random(count)
    fields = {
        "position": np.asarray(space.box.lower) + lattice + jitter,
        "velocity": rng.normal(size=(count, dim)),
        "density": density,
        "pressure": rng.normal(size=count),
        "volume": space.spacing**dim / density,
        "shift_velocity": rng.normal(size=(count, dim)),
        "density_gradient": rng.normal(size=(count, dim)),
    }
    return {name: jnp.asarray(value, dtype) for name, value in fields.items()}


def make_list(space, fields, slack=2):
    """The list by brute force in numpy, in a random order, with `slack` free slots in each row."""
    position = np.asarray(fields["position"], np.float64)
    count = len(position)
    order = np.random.default_rng(count).permutation(count)
    distance = distances(space, position[order])
    near = distance < space.support + SKIN * space.spacing
    np.fill_diagonal(near, False)
    capacity = near.sum(1).max() + slack
    index = np.broadcast_to(np.arange(count)[:, None], (count, capacity)).copy()
    for row, here in enumerate(near):
        index[row, : here.sum()] = np.flatnonzero(here)
    return VerletList(
        index=jnp.asarray(index, jnp.int32),
        order=jnp.asarray(order, jnp.int32),
        inverse=jnp.asarray(np.argsort(order), jnp.int32),
        reference=fields["position"],
        largest_count=jnp.asarray(near.sum(1).max(), jnp.int32),
        cell_overflow=jnp.asarray(0, jnp.int32),
    )


def separations(space, position):
    """x_j - x_i by the nearest image, (N, N, n)."""
    d = position[None] - position[:, None]
    length = np.asarray(space.box.lengths)
    return d - length * np.round(d / length)


def distances(space, position):
    return np.sqrt((separations(space, position) ** 2).sum(-1))


@partial(jax.jit, static_argnums=(0, 2))
def sums_of(terms, fields, space, neighbors):
    """Sums in the particles' own order."""
    sums = pair_sum(terms, jax.tree.map(neighbors.sort, fields), space, neighbors)
    return jax.tree.map(neighbors.unsort, sums)


# ------------------------------------------------------------------ dense sums


def kernel_and_slope(kernel, r, h, dim):
    """W and dW/dr in numpy, from the closed forms in the literature."""
    q = r / h
    if isinstance(kernel, QuinticSpline):
        a = {2: 7.0 / (478.0 * pi), 3: 1.0 / (120.0 * pi)}[dim]
        parts = [(1.0, 3.0), (-6.0, 2.0), (15.0, 1.0)]
        value = sum(c * np.maximum(k - q, 0.0) ** 5 for c, k in parts)
        slope = sum(-5.0 * c * np.maximum(k - q, 0.0) ** 4 for c, k in parts)
    elif isinstance(kernel, WendlandC4):
        a = {2: 9.0 / (4.0 * pi), 3: 495.0 / (256.0 * pi)}[dim]
        t = np.maximum(1.0 - 0.5 * q, 0.0)
        value = t**6 * (1.0 + 3.0 * q + 35.0 / 12.0 * q**2)
        slope = -14.0 / 3.0 * q * (1.0 + 2.5 * q) * t**5
    else:
        a = {2: 7.0 / (4.0 * pi), 3: 21.0 / (16.0 * pi)}[dim]
        t = np.maximum(1.0 - 0.5 * q, 0.0)
        value = t**4 * (1.0 + 2.0 * q)
        slope = -5.0 * q * t**3
    return a / h**dim * value, a / h ** (dim + 1) * slope


def dense_sums(space, fields):
    """The ten sums over all N x N pairs, and the sums of the summands' absolute values."""
    f = {name: np.asarray(value, np.float64) for name, value in fields.items()}
    dim, h = space.box.dim, space.smoothing_length
    d = separations(space, f["position"])
    r = distances(space, f["position"])
    np.fill_diagonal(r, 10.0 * h)  # out of the support
    w, slope = kernel_and_slope(space.kernel, r, h, dim)
    radial = -slope / r * f["volume"][None, :]
    grad = radial[..., None] * d  # grad_i W_ij V_j: towards j, where W_ij grows
    u, rho, p = f["velocity"], f["density"], f["pressure"]
    du, slope_rho = f["shift_velocity"], f["density_gradient"]
    i, j = np.s_[:, None], np.s_[None, :]
    a, b = np.triu_indices(dim)
    at_spacing = kernel_and_slope(space.kernel, np.asarray(space.spacing), h, dim)[0]
    along_i, along_j = ((du[k] * grad).sum(-1) for k in (i, j))
    summands = {
        "renormalisation": d[..., a] * grad[..., b],
        "raw_density_gradient": (rho[j] - rho[i])[..., None] * grad,
        "shifting_sum": ((1.0 + 0.2 * w / at_spacing) ** 4)[..., None] * grad,
        "velocity_divergence": ((u[j] - u[i]) * grad).sum(-1),
        "pressure_gradient": (p[i] + p[j])[..., None] * grad,
        "viscous_sum": (((u[j] - u[i]) * d).sum(-1) / r**2)[..., None] * grad,
        "diffusion_sum": (rho[j] - rho[i] - ((slope_rho[i] + slope_rho[j]) * d).sum(-1) / 2)
        * radial,
        "shift_divergence": along_j - along_i,
        "shift_mass_flux": rho[j] * along_j + rho[i] * along_i,
        "shift_momentum_flux": u[j] * along_j[..., None] + u[i] * along_i[..., None],
    }
    exact = {name: s.sum(1) for name, s in summands.items()}
    return exact, {name: np.abs(s).sum(1).max() for name, s in summands.items()}


def check_sums(space, fields, neighbors, tolerance):
    found = sums_of(delta_plus_terms(space), fields, space, neighbors)
    exact, size = dense_sums(space, fields)
    assert found.keys() == exact.keys()
    for name, value in exact.items():
        assert found[name].dtype == fields["position"].dtype
        assert found[name].shape == value.shape
        np.testing.assert_allclose(found[name], value, atol=tolerance * size[name], err_msg=name)


@pytest.mark.parametrize("kernel", [WendlandC2(), WendlandC4(), QuinticSpline()], ids=repr)
@pytest.mark.parametrize("dim, side", [(2, 12), (3, 7)])
@pytest.mark.parametrize(
    "dtype, tolerance",
    [
        (jnp.float64, 1e-12),  # round-off of the sum and of (1 - q/2) near the support
        (jnp.float32, 3e-5),  # separations of order dx are differences of 1 +- 6e-8, dx = 1/12
    ],
    ids=["double", "single"],
)
def test_equals_the_dense_sum(kernel, dim, side, dtype, tolerance):
    space = make_space(dim, side, kernel)
    fields = make_fields(space, dtype=dtype)
    check_sums(space, fields, make_list(space, fields), tolerance)


def test_equals_the_dense_sum_over_several_uneven_chunks():
    space = make_space(2, 35, h_over_dx=4.0)  # 1225 rows of about 220 slots: three chunks
    fields = make_fields(space)
    check_sums(space, fields, make_list(space, fields), 1e-12)  # round-off


AS_USERS = {"xla_cpu_use_fusion_emitters": True}  # which tests else go without (`conftest.py`)


def test_compiler_options_change_a_sum_by_rounding_only():
    space = make_space(2, 30)
    fields = make_fields(space)
    neighbors, terms = make_list(space, fields), delta_plus_terms(space)
    program = jax.jit(lambda f, n: sums_of(terms, f, space, n)).lower(fields, neighbors)
    _, size = dense_sums(space, fields)
    in_order = program.compile(AS_USERS)(fields, neighbors)
    found = program.compile(COMPILER_OPTIONS | AS_USERS)(fields, neighbors)
    assert any((found[name] != in_order[name]).any() for name in in_order)  # they do act
    for name, value in in_order.items():
        np.testing.assert_allclose(found[name], value, atol=1e-13 * size[name], err_msg=name)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_compiler_options_keep_what_is_not_finite(bad):
    space = make_space(2, 20)
    fields = make_fields(space)
    neighbors = make_list(space, fields)
    fields["density"] = fields["density"].at[7].set(bad)  # in a `where`, a NaN could be lost
    terms = tuple(t for t in delta_plus_terms(space) if t.name == "diffusion_sum")
    program = jax.jit(lambda f, n: sums_of(terms, f, space, n)).lower(fields, neighbors)
    in_order = program.compile(AS_USERS)(fields, neighbors)
    found = program.compile(COMPILER_OPTIONS | AS_USERS)(fields, neighbors)
    lost = ~np.isfinite(in_order["diffusion_sum"])
    assert 10 < lost.sum() < 50  # those around it
    np.testing.assert_array_equal(~np.isfinite(found["diffusion_sum"]), lost)


def test_equal_terms_are_summed_once():
    space = make_space(2, 10)
    fields = make_fields(space)
    neighbors, terms = make_list(space, fields), delta_plus_terms(space)

    def outputs(terms):
        jaxpr = jax.make_jaxpr(lambda f: pair_sum(terms, f, space, neighbors))(fields)
        return [len(e.outvars) for e in jaxpr.eqns if e.primitive is pair_sum_p]

    assert outputs(terms) == [17]  # components of the ten sums in 2D, one primitive for all
    assert outputs(terms + delta_plus_terms(space)) == [17]


# ------------------------------------------------------------------ derivatives

STEP = 1e-5  # of a spacing: truncation 1e-10, round-off 1e-15 / 1e-5, kernels of order one
HARDEST = ("shifting_sum", "viscous_sum", "diffusion_sum")  # kernel, 1/r^2 and 1/r at work


class Case:
    """Sums as a function of position, velocity and density, with directions to move these in."""

    def __init__(self, dim, side, names=None, seed=0):
        self.space = make_space(dim, side, h_over_dx=1.2)
        terms = delta_plus_terms(self.space)
        self.terms = tuple(t for t in terms if names is None or t.name in names)
        self.fields = make_fields(self.space, seed)
        self.neighbors = make_list(self.space, self.fields, slack=8)
        rng = np.random.default_rng(seed + 9)
        sizes = {"position": self.space.spacing, "velocity": 1.0, "density": 0.1}
        self.direction = {
            name: jnp.asarray(rng.normal(size=self.fields[name].shape) * size)
            for name, size in sizes.items()
        }
        self.moved = {name: self.fields[name] for name in sizes}
        sums = self.sums(self.moved, self.neighbors)
        self.weights = {
            k: jnp.asarray(rng.normal(size=s.shape)) / jnp.sqrt(jnp.mean(s * s))
            for k, s in sums.items()
        }

    def sums(self, moved, neighbors):
        """Volume follows density, so that density counts as m / rho as well."""
        volume = self.space.spacing**self.space.box.dim / moved["density"]
        fields = self.fields | moved | {"volume": volume}
        return sums_of(self.terms, fields, self.space, neighbors)

    def scalar(self, moved, neighbors):
        """Quadratic in the sums, each scaled to order one, so that second derivatives mix them."""
        scaled = [self.weights[k] * s for k, s in self.sums(moved, neighbors).items()]
        return sum(jnp.sum(s + s * s) for s in scaled)

    def jvp(self, moved, neighbors, direction=None):
        direction = self.direction if direction is None else direction
        return jax.jvp(lambda m: self.sums(m, neighbors), (moved,), (direction,))[1]

    def along(self, step, direction=None):
        direction = self.direction if direction is None else direction
        return {k: self.fields[k] + step * d for k, d in direction.items()}


cases = pytest.mark.parametrize("dim, side", [(2, 10), (3, 7)], ids=["2d", "3d"])


def inner(a, b):
    return sum(jnp.sum(x * y) for x, y in zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True))


def norm(a):
    return jnp.sqrt(inner(a, a))


@cases
def test_jvp_equals_central_differences_and_vjp_is_its_adjoint(dim, side):
    case = Case(dim, side)
    jvp = jax.jit(case.jvp)
    vjp = jax.jit(lambda m, w: jax.vjp(lambda m: case.sums(m, case.neighbors), m)[1](w)[0])
    pulled = vjp(case.moved, case.weights)
    for name in ("position", "velocity", "density", "all"):
        direction = {
            k: d if name in (k, "all") else jnp.zeros_like(d) for k, d in case.direction.items()
        }
        tangent = jvp(case.moved, case.neighbors, direction)
        forward, backward = (
            case.sums(case.along(s, direction), case.neighbors) for s in (STEP, -STEP)
        )
        for k, t in tangent.items():
            difference = (forward[k] - backward[k]) / (2.0 * STEP)
            scale = jnp.max(jnp.abs(difference)) + 1e-3 * jnp.max(jnp.abs(forward[k]))
            np.testing.assert_allclose(t, difference, atol=1e-6 * float(scale), err_msg=k)
        # 1e-12 of the norms' product: round-off of sums over the same pairs in another order
        gap = inner(case.weights, tangent) - inner(pulled, direction)
        assert abs(gap) < 1e-12 * norm(case.weights) * norm(tangent)
        assert inner(pulled, direction) != 0.0


@pytest.mark.parametrize("dim, side, names", [(2, 10, HARDEST), (3, 7, HARDEST[1:2])])
def test_second_derivatives_either_way_equal_central_differences(dim, side, names):
    case = Case(dim, side, names)

    def scalar(moved):
        return case.scalar(moved, case.neighbors)

    @jax.jit
    def products(moved, direction):
        forward_over_reverse = jax.jvp(jax.grad(scalar), (moved,), (direction,))[1]
        reverse_over_forward = jax.grad(lambda m: jax.jvp(scalar, (m,), (direction,))[1])(moved)
        return forward_over_reverse, reverse_over_forward

    gradient = jax.jit(jax.grad(scalar))
    forward, backward = gradient(case.along(STEP)), gradient(case.along(-STEP))
    first, second = products(case.moved, case.direction)
    for k in case.direction:
        difference = (forward[k] - backward[k]) / (2.0 * STEP)
        scale = float(jnp.max(jnp.abs(difference)))
        # truncation 1e-10 times the kernel's third derivative, round-off 1e-15 / 1e-5
        np.testing.assert_allclose(first[k], difference, atol=1e-6 * scale, err_msg=k)
        np.testing.assert_allclose(second[k], first[k], atol=1e-11 * scale, err_msg=k)  # round-off


def primitives(jaxpr):
    """Names of all primitives, inner jaxprs included."""
    for equation in jaxpr.eqns:
        yield equation.primitive.name
        for inner_jaxpr in jaxprs_in_params(equation.params):
            yield from primitives(inner_jaxpr)


def test_reverse_mode_is_a_pair_sum_again_and_scatters_nothing():
    case = Case(2, 10)
    fields = jax.tree.map(case.neighbors.sort, case.fields)

    def scalar(fields):
        sums = pair_sum(delta_plus_terms(case.space), fields, case.space, case.neighbors)
        return sum(jnp.sum(s * s) for s in sums.values())

    names = list(primitives(jax.make_jaxpr(jax.grad(scalar))(fields).jaxpr))
    assert names.count("pair_sum") == 2  # the primal and its transpose
    assert not [name for name in names if "scatter" in name]
    assert "scatter" not in jax.jit(jax.grad(scalar)).lower(fields).as_text()


# ------------------------------------------------------------------ batching


@pytest.mark.parametrize("shared", [True, False], ids=["one list", "a list each"])
def test_vmap_equals_a_loop(shared):
    members = [Case(2, 10, HARDEST, seed) for seed in ((0, 0, 0) if shared else (0, 1, 2))]
    case = members[0]
    moved = [member.along(0.02 * k) for k, member in enumerate(members)]
    width = min(member.neighbors.index.shape[1] for member in members)
    lists = [
        eqx.tree_at(lambda n: n.index, member.neighbors, member.neighbors.index[:, :width])
        for member in members
    ]
    assert all(int(n.largest_count) <= width for n in lists), "only free slots were cut off"

    def stack(trees):
        return jax.tree.map(lambda *a: jnp.stack(a), *trees)

    stacked = (stack(moved), lists[0] if shared else stack(lists))
    functions = (case.sums, case.jvp, jax.grad(case.scalar))
    for function in functions[2:] if shared else functions:
        one = jax.jit(function)
        loop = stack([one(m, n) for m, n in zip(moved, lists, strict=True)])
        mapped = jax.jit(jax.vmap(function, (0, None if shared else 0)))(*stacked)
        for a, b in zip(jax.tree.leaves(mapped), jax.tree.leaves(loop), strict=True):
            # the same sums, perhaps fused otherwise: a few units in the last place
            np.testing.assert_allclose(a, b, atol=1e-13 * float(jnp.max(jnp.abs(b))))


def test_what_members_share_has_the_sum_of_their_cotangents():
    """Reverse mode of a batch, of its shared fields too; and a batch of batches."""
    case = Case(2, 8, HARDEST[1:2])
    own = jnp.stack([case.along(0.02 * k)["position"] for k in range(4)])
    velocity = case.fields["velocity"]

    def one(position, velocity):
        moved = {**case.moved, "position": position, "velocity": velocity}
        return case.scalar(moved, case.neighbors)

    def of_all(own, velocity):
        return jnp.sum(jnp.cos(jax.vmap(one, (0, None))(own, velocity)))

    def in_turn(own, velocity):
        return sum(jnp.cos(one(position, velocity)) for position in own)

    found, exact = (jax.jit(jax.grad(f, (0, 1)))(own, velocity) for f in (of_all, in_turn))
    for a, b in zip(found, exact, strict=True):
        # the same sums in another order
        np.testing.assert_allclose(a, b, atol=1e-13 * float(jnp.max(jnp.abs(b))))
    twice = jax.vmap(jax.vmap(one, (0, None)), (None, 0))
    faster = jnp.stack([velocity, 2.0 * velocity])
    once = jax.jit(jax.vmap(one, (0, None)))(own, faster[1])
    np.testing.assert_allclose(jax.jit(twice)(own, faster)[1], once, rtol=1e-13)


# ------------------------------------------------------------------ pairs at zero distance


@pytest.mark.parametrize("dim", [2, 3])
def test_coincident_and_lonely_particles_add_nothing(dim):
    space = make_space(dim, 7)
    places = np.zeros((6, dim))
    places[2:4] = 0.5  # two pairs at one place each, far apart, and two particles alone
    places[4], places[5] = 0.25, 0.75
    fields = {k: v[: len(places)] for k, v in make_fields(space).items()}
    fields["position"] = jnp.asarray(places + np.asarray(space.box.lower))
    neighbors = make_list(space, fields)
    assert int(neighbors.largest_count) == 1  # free slots abound

    def scalar(fields):
        sums = sums_of(delta_plus_terms(space), fields, space, neighbors)
        return sum(jnp.sum(s + s * s) for s in sums.values())  # NaN would show

    @jax.jit
    def derivatives(fields, ones):
        return jax.jvp(jax.value_and_grad(scalar), (fields,), (ones,))

    for leaf in jax.tree.leaves(derivatives(fields, jax.tree.map(jnp.ones_like, fields))):
        np.testing.assert_array_equal(leaf, jnp.zeros_like(leaf))


# ------------------------------------------------------------------ misuse


def test_terms_and_fields_that_do_not_fit_raise():
    space = make_space(2, 10)
    fields = make_fields(space)
    neighbors = make_list(space, fields)
    first = PairTerm("same", ("pressure",), lambda pair, i, j: pair.kernel * j.pressure)
    second = PairTerm("same", ("density",), lambda pair, i, j: pair.kernel * j.density)
    with pytest.raises(ValueError, match="terms: two different terms share a name"):
        pair_sum((first, second), fields, space, neighbors)
    for missing in ("pressure", "volume", "position"):
        present = {name: field for name, field in fields.items() if name != missing}
        with pytest.raises(ValueError, match=rf"fields: \['{missing}'\]"):
            pair_sum((first,), present, space, neighbors)
