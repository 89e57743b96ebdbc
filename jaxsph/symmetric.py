"""Matrices of size 2 or 3, one a particle; symmetric ones by rows of their upper triangles."""

from __future__ import annotations

from itertools import combinations_with_replacement

import jax.numpy as jnp
from jaxtyping import Array, Float

from .ramps import root
from .vector import Vector

_REGULAR = 1e-3  # of the determinant; a full neighbourhood's is 1


def size_of(entries: int) -> int:
    """Rows of a matrix whose upper triangle has so many entries: 3 or 6."""
    return {3: 2, 6: 3}[entries]


def places(size: int) -> dict[tuple[int, int], int]:
    """Where the entry of a row and a column stands in the upper triangle."""
    pairs = enumerate(combinations_with_replacement(range(size), 2))
    return {place: k for k, (a, b) in pairs for place in ((a, b), (b, a))}


def outer(a: Vector, b: Vector) -> Vector:
    """Upper triangle of a (x) b, which should be symmetric."""
    return Vector(a[row] * b[column] for row, column in _upper(len(a)))


def product(upper: Vector, vector: Vector) -> Vector:
    """A v inside a pair function, A by its upper triangle."""
    place, size = places(len(vector)), range(len(vector))
    return Vector(
        sum((upper[place[a, b]] * vector[b] for b in size[1:]), upper[place[a, 0]] * vector[0])
        for a in size
    )


def times(
    upper: Float[Array, "particles entries"], vectors: Float[Array, "particles dim"]
) -> Float[Array, "particles dim"]:
    """A v of each particle."""
    columns = product(Vector(upper.T), Vector(vectors.T))
    return jnp.stack(columns, axis=1)


def along(
    matrices: Float[Array, "particles dim dim"], vectors: Float[Array, "particles dim"]
) -> Float[Array, "particles dim"]:
    """A v of each particle, A as a whole."""
    columns = range(vectors.shape[1])
    return sum(matrices[:, :, k] * vectors[:, k : k + 1] for k in columns)


def inverse(
    upper: Float[Array, "particles entries"], singular: float
) -> Float[Array, "particles entries"]:
    """A^-1 of each particle; `singular` times the identity where A has none."""
    size = size_of(upper.shape[1])
    place = places(size)
    a = {key: upper[:, k] for key, k in place.items()}
    adjugate, determinant = (_adjugate_2 if size == 2 else _adjugate_3)(a)
    regular = jnp.abs(determinant) > _REGULAR
    scale = 1.0 / jnp.where(regular, determinant, 1.0)
    return jnp.stack(
        [
            jnp.where(regular, scale * adjugate[row, column], singular if row == column else 0.0)
            for row, column in _upper(size)
        ],
        axis=1,
    )


def _upper(size: int):
    return combinations_with_replacement(range(size), 2)


def _adjugate_2(a):
    found = {(0, 0): a[1, 1], (0, 1): -a[0, 1], (1, 1): a[0, 0]}
    return found, a[0, 0] * a[1, 1] - a[0, 1] * a[0, 1]


def _adjugate_3(a):
    found = {
        (0, 0): a[1, 1] * a[2, 2] - a[1, 2] * a[1, 2],
        (0, 1): a[0, 2] * a[1, 2] - a[0, 1] * a[2, 2],
        (0, 2): a[0, 1] * a[1, 2] - a[0, 2] * a[1, 1],
        (1, 1): a[0, 0] * a[2, 2] - a[0, 2] * a[0, 2],
        (1, 2): a[0, 1] * a[0, 2] - a[0, 0] * a[1, 2],
        (2, 2): a[0, 0] * a[1, 1] - a[0, 1] * a[0, 1],
    }
    return found, sum(a[0, k] * found[0, k] for k in range(3))


def smallest_eigenvalue(upper):
    """Of symmetric matrices of size 2 or 3, given by rows (N, 3) or (N, 6) of upper triangles.

    Where eigenvalues coincide the derivative counts as zero.
    """
    if upper.shape[1] == 3:
        a, b, d = (upper[:, k] for k in range(3))
        return 0.5 * (a + d) - root((0.5 * (a - d)) ** 2 + b * b)
    a, b, c, d, e, f = (upper[:, k] for k in range(6))
    mean = (a + d + f) / 3.0
    a, d, f = a - mean, d - mean, f - mean
    size = root((a * a + d * d + f * f + 2.0 * (b * b + c * c + e * e)) / 6.0)
    safe = jnp.where(size > 0.0, size, 1.0)
    determinant = a * (d * f - e * e) - b * (b * f - c * e) + c * (b * e - c * d)
    cosine = jnp.clip(0.5 * determinant / safe**3, -1.0 + 1e-9, 1.0 - 1e-9)
    return mean + 2.0 * size * jnp.cos((jnp.arccos(cosine) + 2.0 * jnp.pi) / 3.0)
