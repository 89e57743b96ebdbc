"""How numbers depend on parameters: by a law that is found, or between the training points."""

from __future__ import annotations

from itertools import combinations_with_replacement, product
from typing import Self

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

_ROUND_OFF = 1e5  # times the precision
_LOOSEST = 3e-4  # of the largest value, in any precision
_MORE = 2  # points beyond the unknowns, at least: they test the law


class Law(eqx.Module):
    """y = W m(x), x_k = p_k or 1 / p_k, m the products of up to two of 1 and the x_k.

    It holds at every point that it was found from, and these are more than its unknowns: a
    viscosity of 1 / Re, a force of 8 U / Re, a start of an amplitude and its square.

    Args:
        weights: W, rows of numbers that follow another form are zero (forms, Y, products).
        inverted: which x_k are 1 / p_k (forms, names) (static).
    """

    weights: Float[Array, "forms values products"]
    inverted: tuple[tuple[bool, ...], ...] = eqx.field(static=True)

    @classmethod
    def find(
        cls,
        points: Float[np.ndarray, "points names"],
        values: Float[np.ndarray, "points values"],
        scale: Float[np.ndarray, " values"] | None = None,
    ) -> Self | None:
        """A law that holds at all points, if there is one.

        Args:
            points: parameters.
            values: y there.
            scale: of each number; its own largest value if none is given.
        """
        count, names = points.shape
        dtype = values.dtype
        values = np.asarray(values, float)
        scale = np.abs(values).max(axis=0, initial=0.0) if scale is None else scale
        eps = np.finfo(dtype).eps
        allowed = min(_ROUND_OFF * eps, _LOOSEST) * scale
        varied = bool(np.ptp(values, axis=0).any())
        forms, weights, errors = [], [], []
        for inverted in product((False, True), repeat=names):
            if any(i and (points[:, k] == 0.0).any() for k, i in enumerate(inverted)):
                continue
            features = np.stack([np.asarray(_products(p, inverted)) for p in points])
            if count < features.shape[1] + _MORE and varied:
                return None
            size = np.abs(features).max(axis=0)
            size = np.where(size > 0.0, size, 1.0)
            found = np.linalg.lstsq(features / size, values, rcond=1e-13)[0] / size[:, None]
            forms.append(inverted)
            weights.append(found.T)
            errors.append(np.abs(features @ found - values).max(axis=0))
        # of forms that do as well the first, or 1 / Re would pass for a parabola within a tolerance
        good = errors <= 4.0 * np.min(errors, axis=0) + 64.0 * eps * scale
        chosen = np.argmax(good, axis=0)
        if not (np.take_along_axis(np.asarray(errors), chosen[None], 0)[0] <= allowed).all():
            return None
        used = [k for k in range(len(forms)) if (chosen == k).any()] or [0]
        kept = [np.where((chosen == k)[:, None], weights[k], 0.0) for k in used]
        return cls(jnp.asarray(np.stack(kept), dtype), tuple(forms[k] for k in used))

    def __call__(self, point: Float[Array, " names"]) -> Float[Array, " values"]:
        point = jnp.asarray(point, self.weights.dtype)
        parts = zip(self.weights, self.inverted, strict=True)
        return sum(w @ _products(point, inverted, jnp) for w, inverted in parts)


def _products(point, inverted, xp=np):
    x = [1.0 / point[k] if i else point[k] for k, i in enumerate(inverted)]
    one = xp.ones_like(point[0])
    factors = [one, *x]
    return xp.stack([a * b for a, b in combinations_with_replacement(factors, 2)])


class Between(eqx.Module):
    """y = c + sum_k w_k |x - x_k| between the training points x_k, x in their range's width: with
    one parameter the broken line through them, constant beyond its ends.

    Args:
        points: x_k (R, n), low and width of their range.
        weights: w_k (R, Y).
        constant: c (Y,).
        left_out: largest error at a training point if that one is left out, over the largest y;
            infinite where two are not left.
    """

    points: Float[Array, "points names"]
    low: Float[Array, " names"]
    width: Float[Array, " names"]
    weights: Float[Array, "points values"]
    constant: Float[Array, " values"]
    left_out: float = eqx.field(static=True)

    @classmethod
    def of(
        cls, points: Float[np.ndarray, "points names"], values: Float[np.ndarray, "points values"]
    ) -> Self:
        """Through all points."""
        dtype = values.dtype
        low, high = points.min(axis=0), points.max(axis=0)
        width = np.where(high > low, high - low, 1.0)
        x, values = (points - low) / width, np.asarray(values, float)
        weights, constant = _through(x, values)
        error, largest = np.inf, np.abs(values).max(initial=0.0)
        if len(points) > 2:
            inner = [k for k in range(len(x)) if (x[k] > 0.0).all() and (x[k] < 1.0).all()]
            error = 0.0
            for k in inner or range(len(x)):
                rest = np.delete(np.arange(len(x)), k)
                w, c = _through(x[rest], values[rest])
                there = c + np.linalg.norm(x[k] - x[rest], axis=1) @ w
                error = max(error, float(np.abs(there - values[k]).max()))
            error = float(error / largest) if largest > 0.0 else 0.0
        arrays = (x, low, width, weights, constant)
        return cls(*(jnp.asarray(a, dtype) for a in arrays), error)

    def __call__(self, point: Float[Array, " names"]) -> Float[Array, " values"]:
        x = (jnp.asarray(point, self.low.dtype) - self.low) / self.width
        away = jnp.sum((x[None, :] - self.points) ** 2, axis=1)
        there = away > 0.0  # at a training point the distance has no slope
        distance = jnp.where(there, jnp.sqrt(jnp.where(there, away, 1.0)), 0.0)
        return self.constant + distance @ self.weights


def _through(x, values):
    """Weights and constant of the function through values at points."""
    count = len(x)
    if count == 1:
        return np.zeros_like(values), values[0]
    distance = np.linalg.norm(x[:, None] - x[None], axis=2)
    matrix = np.block([[distance, np.ones((count, 1))], [np.ones((1, count)), np.zeros((1, 1))]])
    found = np.linalg.solve(matrix, np.concatenate([values, np.zeros_like(values[:1])]))
    return found[:-1], found[-1]
