"""The curl of the velocity at particles, for figures."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree

NEAREST = {2: 13, 3: 33}  # particles of a fit, itself included: a disc or a ball of two spacings
_SINGULAR = 1e-9  # of the trace: particles in a line have no gradient across it


def vorticity(
    position: Float[np.ndarray, "particles dim"], velocity: Float[np.ndarray, "particles dim"]
) -> Float[np.ndarray, " particles"]:
    """dv/dx - du/dy [1/s], or in three dimensions the norm of the curl, by weighted least squares:

        sum_j w_ij (x_j - x_i) (x_j - x_i)^T  grad u_i = sum_j w_ij (x_j - x_i) (u_j - u_i)^T,

    over the nearest particles; exact for linear fields, however particles lie. Beside walls and the
    ends of a periodic box the fit is one-sided.

    Args:
        position: of the particles [m].
        velocity: of the particles [m/s].

    Examples:
        >>> import numpy as np
        >>> from jaxsph.plotting import vorticity
        >>> x = np.random.default_rng(0).random((50, 2))
        >>> vorticity(x, 3.0 * np.stack([-x[:, 1], x[:, 0]], axis=1))[:2].round(6)
        array([6., 6.])
    """
    position, velocity = np.asarray(position, float), np.asarray(velocity, float)
    dim = position.shape[1]
    count = min(NEAREST[dim], len(position))
    distance, near = cKDTree(position).query(position, k=count)
    apart = position[near] - position[:, None]
    change = velocity[near] - velocity[:, None]
    weight = (1.0 - distance / (1.1 * distance[:, -1:] + np.finfo(float).tiny)) ** 2
    weighted = weight[..., None] * apart
    matrix = np.einsum("ika,ikb->iab", weighted, apart)
    trace = np.trace(matrix, axis1=1, axis2=2)[:, None, None]
    matrix += (_SINGULAR * trace + np.finfo(float).tiny) * np.eye(dim)
    slope = np.linalg.solve(matrix, np.einsum("ika,ikb->iab", weighted, change))  # d u_b / d x_a
    turning = slope - slope.transpose(0, 2, 1)
    if dim == 2:
        return turning[:, 0, 1]
    return np.sqrt(0.5 * (turning**2).sum(axis=(1, 2)))
