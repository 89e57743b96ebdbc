"""How rigid bodies turn: by an angle in two dimensions, by a rotation vector in three.

A rotation vector a is the axis of a turn, times its angle |a| in rad; a spin w is in the axes of
the box. Both have a shape () in two dimensions and (3,) in three, or one more axis for several.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import jax.numpy as jnp
from jaxtyping import Array, Float

_SMALL = 0.01  # rad^2: below, series to the fourth power of the squared angle; exact to round-off
_SINE = (1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362880.0)
_COSINE = (1.0 / 2.0, -1.0 / 24.0, 1.0 / 720.0, -1.0 / 40320.0, 1.0 / 3628800.0)
_COTANGENT = (1.0 / 12.0, 1.0 / 720.0, 1.0 / 30240.0, 1.0 / 1209600.0, 1.0 / 47900160.0)


def turned(angle: Array, vector: Float[Array, "points dim"]) -> Float[Array, "points dim"]:
    """Vectors turned by one angle for all or one for each:

        v + sin(|a|) / |a| (a x v) + (1 - cos(|a|)) / |a|^2 a x (a x v)

    in three dimensions (Rodrigues 1840).
    """
    if vector.shape[1] == 2:
        cosine, sine = jnp.cos(angle), jnp.sin(angle)
        x, y = vector[:, 0], vector[:, 1]
        return jnp.stack([cosine * x - sine * y, sine * x + cosine * y], axis=1)
    angle = jnp.broadcast_to(angle, vector.shape)
    square = jnp.sum(angle * angle, axis=1, keepdims=True)
    first = _of(square, lambda t: jnp.sin(t) / t, _SINE)
    second = _of(square, lambda t: 2.0 * (jnp.sin(0.5 * t) / t) ** 2, _COSINE)
    once = across(angle, vector)
    return vector + first * once + second * across(angle, once)


def turned_on(here: Array, then: Array, vector: Float[Array, "points dim"]) -> Array:
    """Vectors of bodies that are turned by the angles `here`, where they are turned by `then`."""
    if vector.shape[1] == 2:
        return turned(then - here, vector)
    return turned(then, turned(-here, vector))


def across(spin: Array, arm: Float[Array, "points dim"]) -> Float[Array, "points dim"]:
    """w x r, of one spin for all arms or one for each."""
    if arm.shape[1] == 2:
        quarter = jnp.stack([-arm[:, 1], arm[:, 0]], axis=1)
        return jnp.broadcast_to(spin, arm.shape[:1])[:, None] * quarter
    return jnp.cross(jnp.broadcast_to(spin, arm.shape), arm)


def angle_rate(angle: Array, spin: Array) -> Array:
    """d(angle)/dt [rad/s] of bodies that spin:

        w - a x w / 2 + (1 - |a| / 2 cot(|a| / 2)) / |a|^2 a x (a x w)

    in three dimensions (Bortz 1971, there in the body's own axes), for |a| below 2 pi.
    """
    if angle.ndim == 1:
        return spin
    square = jnp.sum(angle * angle, axis=1, keepdims=True)

    def exact(t):
        return (1.0 - 0.5 * t / jnp.tan(0.5 * t)) / (t * t)

    once = across(angle, spin)
    return spin - 0.5 * once + _of(square, exact, _COTANGENT) * across(angle, once)


def within_half_a_turn(angle: Array) -> Array:
    """The same turns of several bodies by rotation vectors of at most pi; plain angles, which count
    turns, as they are."""
    if angle.ndim == 1:
        return angle
    square = jnp.sum(angle * angle, axis=1, keepdims=True)
    far = square > math.pi**2
    size = jnp.sqrt(jnp.where(far, square, 1.0))
    return jnp.where(far, angle * (1.0 - 2.0 * math.pi / size), angle)


def spin_rate(angle: Array, spin: Array, torque: Array, inertia: Array) -> Array:
    """dw/dt [rad/s^2] of several bodies: T / I, and in three dimensions Euler's equations,

        J^-1 (T - w x J w),    J = R I R^T,

    solved in the axes that turn with each body.

    Args:
        angle: by which the bodies have turned since their `inertia` was theirs.
        spin: w [rad/s].
        torque: T [N m].
        inertia: I [kg m^2], (F,), or symmetric (F, 3, 3).
    """
    if angle.ndim == 1:
        return torque / inertia
    own = turned(-angle, spin)
    turning = jnp.einsum("fij,fj->fi", inertia, own)
    left = turned(-angle, torque) - jnp.cross(own, turning)
    return turned(angle, jnp.einsum("fij,fj->fi", inverse(inertia), left))


def inverse(matrix: Float[Array, "bodies 3 3"]) -> Float[Array, "bodies 3 3"]:
    """Of each matrix, by its cofactors; in units of its trace, as the cube of a ship's moment of
    inertia is beyond single precision."""
    size = jnp.trace(matrix, axis1=1, axis2=2)[:, None, None]
    rows = [matrix[:, k] / size[:, :, 0] for k in range(3)]
    cofactors = [jnp.cross(rows[(k + 1) % 3], rows[(k + 2) % 3]) for k in range(3)]
    determinant = jnp.sum(rows[0] * cofactors[0], axis=1)
    return jnp.stack(cofactors, axis=2) / determinant[:, None, None] / size


def _of(square: Array, exact: Callable[[Array], Array], series: Sequence[float]) -> Array:
    """A function of |a|, exact or its series in |a|^2 near zero, where it has a slope as well."""
    small = square < _SMALL
    size = jnp.sqrt(jnp.where(small, 1.0, square))
    near = jnp.where(small, square, 0.0)
    value = jnp.zeros_like(near)
    for coefficient in reversed(series):
        value = coefficient + near * value
    return jnp.where(small, value, exact(size))
