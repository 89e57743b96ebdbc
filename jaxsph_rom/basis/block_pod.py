"""Proper orthogonal decomposition with a basis for each of density and velocity."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from jaxtyping import Float

from jaxsph import Fluid

from .centring import Centring
from .inner_product import InnerProduct
from .pod import Basis, check_snapshots, numerical_rank, weighted_fluctuations, weighted_norm

_BLOCKS = {"density": slice(0, 1), "velocity": slice(1, None)}


def block_pod(
    snapshots: Float[np.ndarray, "points fields times"],
    product: InnerProduct,
    fluid: Fluid,
    modes: int | tuple[int, int] | None = None,
    centring: Centring | None = None,
) -> Basis:
    """POD of density and of velocity, each by itself: X_rho = U S V^T and X_u = U' S' V'^T make

        Phi = [U 0; 0 U'],

    so that small pressures have modes of their own beside the velocity's. Each mode is zero in the
    other field, and all are orthonormal in the product, which has no other say in what they are.

    Density and velocity count alike: each singular value is divided by the norm of its block,
    ||X_rho||_F or ||X_u||_F. By these modes are ordered, so `truncated` keeps what either field
    needs most, and so is 2 eps^2 = eps_rho^2 + eps_u^2 for the relative projection errors of the
    whole (`projection_errors`) and of either field.

    Args:
        snapshots: (G, F, S), density first.
        product: sets the scale of the coordinates.
        fluid: gives the product its scales.
        modes: how many, or how many of density and how many of velocity; all if none is given.
        centring: the product's own if none is given.

    Returns:
        the basis; its singular values, divided as above, are those of the modes, then all others,
        either part from large to small.

    Raises:
        ValueError: if there are fewer snapshots than modes, a value is not finite, or a field
            is its centre at all times.
    """
    points, fields, times = check_snapshots(snapshots)
    scaled, centre, weights = weighted_fluctuations(snapshots, product, fluid, centring)
    (left_rho, rho), (left_u, u) = (
        _decomposed(
            name,
            scaled[:, block].reshape(-1, times),
            weighted_norm(centre[:, block], weights[block], points),
        )
        for name, block in _BLOCKS.items()
    )
    of_rho, of_u = _counts(modes, rho, u, times)
    phi = np.zeros((points, fields, of_rho + of_u), scaled.dtype)
    phi[:, 0, :of_rho] = left_rho[:, :of_rho]
    phi[:, 1:, of_rho:] = left_u[:, :of_u].reshape(points, fields - 1, of_u)
    phi /= np.sqrt(weights)[None, :, None]
    kept = np.concatenate([rho[:of_rho], u[:of_u]])
    others = np.concatenate([rho[of_rho:], u[of_u:]])
    order = np.argsort(-kept, kind="stable")
    sigma = np.concatenate([kept[order], np.sort(others)[::-1]])
    return Basis(modes=phi[:, :, order], centre=centre, weights=weights, singular_values=sigma)


def _decomposed(name: str, matrix: np.ndarray, centre: float) -> tuple[np.ndarray, np.ndarray]:
    """Left singular vectors, and singular values over the norm of the block, without round-off."""
    norm = np.linalg.norm(matrix)
    left, sigma, _ = scipy.linalg.svd(matrix, full_matrices=False, overwrite_a=True)
    rank = numerical_rank(sigma, matrix.shape[1], centre)
    if rank == 0:
        raise ValueError(
            f"snapshots: {name} is the centre at all times, which has no modes; use `pod`."
        )
    return left[:, :rank], sigma[:rank] / norm


def _counts(
    modes: int | tuple[int, int] | None, rho: np.ndarray, u: np.ndarray, times: int
) -> tuple[int, int]:
    """Modes of density and of velocity; always the first ones of either."""
    if modes is None:
        return len(rho), len(u)
    asked = (
        zip(_BLOCKS, modes, (len(rho), len(u)), strict=True)
        if isinstance(modes, tuple)
        else [("both fields", modes, len(rho) + len(u))]
    )
    for name, wanted, count in asked:
        if not 1 <= wanted <= count:
            raise ValueError(
                f"modes: {wanted} of {name} asked for, but {times} snapshots give 1 to {count}; "
                "ask for fewer modes or record more snapshots."
            )
    if isinstance(modes, tuple):
        return modes
    largest = np.argsort(-np.concatenate([rho, u]), kind="stable")[:modes]
    of_rho = int(np.count_nonzero(largest < len(rho)))
    return of_rho, modes - of_rho
