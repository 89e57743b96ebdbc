"""Velocity modes without divergence, as the discrete operators see it."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg
from jaxtyping import Float

from jaxsph import Fluid

from ...basis import Basis
from ...basis.pod import check_modes, check_snapshots, numerical_rank
from .local_matrix import local_matrix
from .reference_operators import ReferenceOperators

_NOTHING = 1e-12  # of the largest entry of D D^T, added so that a periodic box can be solved in


def divergence_matrix(operators: ReferenceOperators) -> scipy.sparse.csr_array:
    """D with D u = div u, the full model's continuity sum on the reference points, walls included.

    D is (G, G n) for u stacked point by point.
    """
    points, space = np.asarray(operators.points), operators.space
    values = operators.coefficients.values(operators.functional)
    density = float(operators.functional.fluid.reference_density)

    def divergence(velocity):
        change = np.concatenate([np.zeros_like(velocity[:, :1]), velocity], axis=1)
        found = operators.along(jnp.asarray(change, points.dtype), values)
        return -np.asarray(found.rates_along[:, 0]) / density

    return local_matrix(divergence, points, points.shape[1], space.box, space.support)


def without_divergence(
    velocity: Float[np.ndarray, "points dim fields"], divergence: scipy.sparse.csr_array
) -> Float[np.ndarray, "points dim fields"]:
    """The nearest fields without discrete divergence, u - D^T (D D^T)^+ D u.

    Args:
        velocity: (G, n, K), several fields at once.
        divergence: D of `divergence_matrix`.
    """
    left = velocity.reshape(-1, velocity.shape[2])
    square = (divergence @ divergence.T).tocsc()
    little = _NOTHING * abs(square).max() * scipy.sparse.eye_array(square.shape[0], format="csc")
    solve = scipy.sparse.linalg.splu(square + little).solve
    for _ in range(2):  # the second time takes what rounding left
        left = left - divergence.T @ solve(divergence @ left)
    return left.reshape(velocity.shape)


def solenoidal_basis(
    snapshots: Float[np.ndarray, "points fields times"],
    operators: ReferenceOperators,
    modes: int | None = None,
) -> Basis:
    """Velocity modes for a flow in which pressure only keeps the divergence zero.

    POD modes of the velocity alone, about rest, are made free of discrete divergence one after the
    other and orthonormal again. Next to a wall a mapped velocity is one-sided and has a divergence
    that no particle saw. As rho0 div u drives pressure through c0^2, a mode that keeps it makes
    sound; a mode without it feels no pressure, as sum_i u_i . (grad p)_i vanishes, so the momentum
    equation alone makes its coordinates: without sound, and with larger steps.

    Args:
        snapshots: (r, u) on the reference points (G, F, S).
        operators: of the scene on these points.
        modes: how many; as many as the numerical rank if none is given.

    Returns:
        a basis whose modes are zero in density. The first m modes are those of fewer modes.

    Raises:
        ValueError: if the snapshots are none, in another order, all at rest, of a lower rank than
            modes are asked for, or not finite.
    """
    points, fields, times = check_snapshots(snapshots)
    if not np.isfinite(snapshots).all():
        raise ValueError("snapshots: a value is not finite; the full model's run has failed.")
    velocity = snapshots[:, 1:].reshape(-1, times)
    left, sigma, _ = scipy.linalg.svd(velocity, full_matrices=False)
    modes = check_modes(modes, numerical_rank(sigma, times, 0.0), times)
    raw = left[:, :modes].reshape(points, fields - 1, modes)
    clean = without_divergence(raw, divergence_matrix(operators)).reshape(-1, modes)
    orthonormal = np.linalg.qr(clean)[0].reshape(points, fields - 1, modes)
    fluid: Fluid = operators.functional.fluid
    rest = np.zeros((1, fields), snapshots.dtype)
    rest[0, 0] = float(fluid.reference_density)
    return Basis(
        modes=np.concatenate([np.zeros_like(orthonormal[:, :1]), orthonormal], axis=1),
        centre=rest,
        weights=np.ones(fields, snapshots.dtype),
        singular_values=sigma,
    )
