"""The Galerkin system on reference points as constant tensors."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from jaxsph.compiled import full_precision
from jaxsph.scenes import Scene

from ...basis import Basis
from .base import Closable
from .opened import Opened
from .reference_operators import ReferenceOperators


class QuadraticSystem(Closable):
    """da/dt = sum_p m_p(theta) (C_p + L_p a) + Q(a, a), the Galerkin system with the coefficients
    theta explicit, m_p their monomials: m_0 = 1, and theta itself, a viscosity say,

        da/dt = C + nu C' + (L + nu L') a + Q(a, a),

    unless `powers` says otherwise. One system serves all coefficients; its cost does not depend on
    the number of particles.

    Args:
        constant: C_p; from a centre that does not rest, forces and moving walls.
        linear: L_p.
        quadratic: Q_kij, symmetric in i and j.
        powers: of theta in each monomial but the first (static).
    """

    constant: Float[Array, "monomials modes"]
    linear: Float[Array, "monomials modes modes"]
    quadratic: Float[Array, "modes modes modes"]
    powers: tuple[tuple[int, ...], ...] = eqx.field(static=True, default=((1,),))

    @property
    def size(self) -> int:
        return self.constant.shape[1]

    def monomials(self, values: Float[Array, " coefficients"]) -> Float[Array, " monomials"]:
        """All but the first."""
        values = jnp.atleast_1d(values)
        found = []
        for powers in self.powers:
            factors = [values[k] ** power for k, power in enumerate(powers) if power]
            found.append(reduce(jnp.multiply, factors))
        return jnp.stack(found) if found else jnp.zeros(0, values.dtype)

    def __call__(
        self, coordinates: Float[Array, " modes"], values: Float[Array, " coefficients"]
    ) -> Float[Array, " modes"]:
        """da/dt, as one matrix times products of coordinates: fast alone and under `vmap`."""
        size = self.size
        ahead = jnp.concatenate([jnp.ones_like(coordinates[:1]), coordinates])
        products = (ahead[:, None] * coordinates[None, :]).reshape(-1)
        monomials = self.monomials(jnp.asarray(values, coordinates.dtype))
        opened = (monomials[:, None] * ahead[None, :]).reshape(-1)
        parts = zip(self.constant[1:], self.linear[1:], strict=True)
        table = jnp.concatenate(
            [
                *(part for c, m in parts for part in (c[:, None], m)),
                self.linear[0],
                self.quadratic.reshape(size, size * size),
            ],
            axis=1,
        )
        return self.constant[0] + table @ jnp.concatenate([opened, products])

    def rates(self, time, coordinates, values):
        return self(coordinates, values)

    def plus(self, first, others):
        places = [0] + [1 + self.powers.index(unit) for unit in _units(len(others))]
        change = jnp.concatenate([first[None], others])
        return eqx.tree_at(
            lambda s: s.linear, self, self.linear.at[jnp.asarray(places)].add(change)
        )

    def truncated(self, modes: int) -> QuadraticSystem:
        """The system of the first modes."""
        return QuadraticSystem(
            self.constant[:, :modes],
            self.linear[:, :modes, :modes],
            self.quadratic[:modes, :modes, :modes],
            self.powers,
        )


def _units(count: int) -> list[tuple[int, ...]]:
    return [tuple(int(k == i) for i in range(count)) for k in range(count)]


def advective(carried: Float[Array, "carrier test carried"]) -> Array:
    """u . grad w as it stands."""
    return carried


def skew_symmetric(carried: Float[Array, "carrier test carried"]) -> Array:
    """u . grad w + (div u) w / 2, tested with v:

        (<v, u . grad w> - <w, u . grad v>) / 2.

    It moves energy between modes and makes none, whatever the divergence left in the discrete u.
    Here w is the fluctuation about rest: (div u) w / 2 of a uniform density would change the speed
    of sound.
    """
    return 0.5 * (carried - jnp.swapaxes(carried, 1, 2))


def galerkin_system(
    scene: Scene,
    basis: Basis,
    points: Float[np.ndarray, "points dim"],
    form: Callable[[Array], Array] = skew_symmetric,
) -> QuadraticSystem:
    """The Galerkin system of a scene on the reference points, in the basis' inner product.

        da/dt = Phi^T W f(centre + Phi a)

    Advection takes the centre's distance from rest as one more mode, of coordinate 1, so that its
    form is that of the whole fluctuation about rest, whatever the centre.

    Args:
        scene: its effects and walls; its viscosity is the coefficient that stays open.
        basis: modes of (r, u), r the logarithmic density, orthonormal in its product.
        points: x_G, where the modes live (G, n) [m].
        form: of advection by modes, `skew_symmetric` or `advective`.
    """
    return projected(ReferenceOperators.of_scene(scene, points), basis, form)


def projected(
    operators: ReferenceOperators,
    basis: Basis,
    form: Callable[[Array], Array] = skew_symmetric,
    opened: Opened | None = None,
) -> QuadraticSystem:
    """`galerkin_system` of operators.

    Args:
        operators: on the reference points.
        basis: modes of (r, u) there.
        form: of advection by modes.
        opened: how operators depend on their coefficients; linearly if it is not given. Advection
            of modes by modes is taken at the middle; only the speed of walls times the change of
            ghosts' volumes, some 1e-6 of all, would change it.
    """
    if opened is None:
        middle = operators.coefficients.values(operators.functional)
        opened = Opened(middle, tuple(_units(len(middle))))
    dtype = operators.points.dtype
    modes, rest = np.asarray(basis.modes), np.asarray(operators.rest)
    centre = np.broadcast_to(np.asarray(basis.centre), modes.shape[:2])
    weights = jnp.asarray(basis.weights, dtype)
    middle = np.asarray(opened.middle, float)
    functions = np.concatenate([(centre - rest)[:, :, None], modes], axis=2).astype(dtype)
    units = np.eye(len(middle))
    # steps that do not vanish beside the rest: what is a polynomial has no other error than that
    steps = [max(1.0, abs(float(m))) for m in middle]

    def at(*moved: tuple[int, float]):
        values = middle
        for k, share in moved:
            values = values + share * steps[k] * units[k]
        values = jnp.asarray(values, dtype)
        found = [operators.along(functions[:, :, k], values) for k in range(functions.shape[2])]
        along = (np.stack(part, axis=-1) for part in zip(*(f[2:] for f in found), strict=True))
        tested = _tested(functions, weights, form, *found[0][:2], *along)
        return [np.asarray(part, float) for part in tested]

    *whole, quadratic = at()
    ahead = [at((k, 1.0))[:2] for k in range(len(middle))]
    bends = {}
    for powers in (p for p in opened.powers if sum(p) == 2):
        k, i = (unit.index(1) for unit in _pair(powers))
        far = at((k, 2.0)) if k == i else at((k, 1.0), (i, 1.0))
        bends[powers] = [
            (far[n] - ahead[k][n] - ahead[i][n] + whole[n]) / (steps[k] * steps[i])
            for n in range(2)
        ]
    parts = []
    for n in range(2):
        slopes = [(part[n] - whole[n]) / steps[k] for k, part in enumerate(ahead)]
        for powers, bend in bends.items():
            if 2 in powers:
                k = powers.index(2)
                slopes[k] = slopes[k] - 0.5 * steps[k] * bend[n]
        second = {powers: bend[n] for powers, bend in bends.items()}
        parts.append(_about_zero(whole[n], slopes, second, middle, opened.powers))
    tensors = (jnp.asarray(part, dtype) for part in (*parts, quadratic))
    return QuadraticSystem(*tensors, opened.powers)


def _pair(powers: tuple[int, ...]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """The two coefficients of a monomial of second degree."""
    k, i = (n for n, count in enumerate(powers) for _ in range(count))
    units = _units(len(powers))
    return units[k], units[i]


def _about_zero(value, slopes, bends, middle, powers):
    """What stands before the monomials, of a value, slopes and bends at the middle."""
    parts = dict(zip(_units(len(middle)), slopes, strict=True))
    first = value - sum(m * slope for m, slope in zip(middle, slopes, strict=True))
    for power, bend in bends.items():
        one, other = _pair(power)
        k, i = one.index(1), other.index(1)
        share = 0.5 if k == i else 1.0
        first = first + share * bend * middle[k] * middle[i]
        parts[one] = parts[one] - share * bend * middle[i]
        parts[other] = parts[other] - share * bend * middle[k]
        parts[power] = share * bend
    return np.stack([first, *(parts[power] for power in powers)])


@eqx.filter_jit
@full_precision
def _tested(functions, weights, form, rates, gradients, rates_along, gradients_along):
    """Constant, linear and quadratic part, of what acts at rest and along each function."""
    weighted = functions * weights[None, :, None]

    def tested(fields):
        return jnp.einsum("gfk,gf...->k...", weighted, fields)

    velocity = jnp.moveaxis(functions[:, 1:], 2, 0)

    def carried(gradient):  # tested, by each velocity in turn
        return lax.map(lambda one: -tested(jnp.einsum("gd,gfd...->gf...", one, gradient)), velocity)

    plain = tested(rates + rates_along[:, :, 0])[1:]
    plain_slopes = tested(rates_along[:, :, 1:])[1:]
    by_walls = carried(gradients)[:, 1:]  # [i, k]: moving walls' part, by mode i
    advection = form(carried(gradients_along))  # [i, k, j]: function j carried by function i
    by_centre, of_centre, by_modes = advection[0, 1:], advection[1:, 1:, 0], advection[1:, 1:, 1:]
    constant = plain + by_centre[:, 0] + by_walls[0]
    linear = plain_slopes + by_centre[:, 1:] + (of_centre + by_walls[1:]).T
    quadratic = 0.5 * (jnp.transpose(by_modes, (1, 0, 2)) + jnp.transpose(by_modes, (1, 2, 0)))
    return constant, linear, quadratic
