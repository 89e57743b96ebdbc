"""Proper orthogonal decomposition of snapshots that come in blocks."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import scipy.linalg
from jaxtyping import Float

from jaxsph import Fluid

from .centring import Centring
from .inner_product import InnerProduct
from .pod import Basis, check_modes, check_order, numerical_rank, weighted_norm


def streaming_pod(
    blocks: Iterable[Float[np.ndarray, "points fields times"]],
    product: InnerProduct,
    fluid: Fluid,
    modes: int | None = None,
    rank: int | None = None,
    centring: Centring | None = None,
) -> Basis:
    """POD of a snapshot matrix X = [C_1, ..., C_J] of which one block C_j is held at a time:

        streaming_pod((reference.snapshots(b) for b in snapshot_blocks(path, 50)), ...).

    Each block updates U and Sigma (Levy & Lindenbaum 2000, Sequential Karhunen-Loeve basis
    extraction and its application to images; Brand 2002, Incremental singular value decomposition
    of uncertain data with missing values):

        Q R = [U Sigma, C_j],    U' Sigma' V'^T = R,    U <- Q U'_k,    Sigma <- Sigma'_k,

    where k leaves out sigma < (columns of R) eps sigma_1, the numerical rank, and what lies beyond
    `rank`. The QR is of all columns, not of the residual of C_j only: so U is orthonormal to
    round-off after any number of blocks, at a cost of the same order, G F (k + s)^2 a block.

    Without `rank` this is the direct SVD up to round-off, and U grows to the numerical rank of X:
    memory and cost are bounded only where a rank is given, say three times `modes`; then about
    2 rank + 4 s columns are in memory. What step j leaves out, D_j, is orthogonal to what it keeps
    on both sides, so U Sigma^2 U^T = X X^T - sum_j D_j D_j^T. Hence a rank r makes singular values
    too small, never too large, and the error of M modes is bounded (s_i are the singular values of
    X itself, centred and weighted as by `pod`):

        s_i^2 - J s_{r+1}^2 <= sigma_i^2 <= s_i^2,
        ||X - U_M U_M^T X||_F^2 <= ||X||_F^2 - sum_{i<=M} sigma_i^2.

    Args:
        blocks: (G, F, s) each, density first, with any s; gone through once, or twice for a
            centre that depends on the snapshots.
        product: `Euclidean()` is the paper's.
        fluid: gives the product its scales.
        modes: how many to keep; all if none is given.
        rank: how many columns of U to carry from block to block; all if none is given.
        centring: the product's own if none is given.

    Returns:
        the basis as of `pod`, with as many singular values as columns of U were carried: under a
        rank their `cumulative_energy` counts what was carried as all there is.

    Raises:
        ValueError: if there are fewer modes in the snapshots, or in the rank, than asked for, if
            blocks differ in points or fields, or if a value is not finite; if blocks that go
            by once are to be centred by their mean.
    """
    _check_wanted(modes, rank)
    centring = product.centring if centring is None else centring
    centre = _centre_of_all(blocks, centring, fluid) if centring.of_snapshots else None
    shape, times = None, 0
    for block in blocks:
        _check_shape(block, shape)
        if shape is None:
            shape = block.shape[:2]
            centre = centring.centre(block, fluid) if centre is None else centre
            weights = np.asarray(product.weights(fluid, shape[1] - 1))
            scale = np.sqrt(weights)[None, :, None]
            dtype = np.result_type(block, centre, weights)
            left, sigma = np.zeros((shape[0] * shape[1], 0), dtype), np.zeros(0, dtype)
        if not np.isfinite(block).all():
            raise ValueError("snapshots: a value is not finite; the full model's run has failed.")
        kept, times = len(sigma), times + block.shape[2]
        columns = np.empty((len(left), kept + block.shape[2]), dtype, order="F")  # as LAPACK's
        np.multiply(left, sigma, out=columns[:, :kept])
        scaled = (block - centre[:, :, None]) * scale
        columns[:, kept:] = scaled.reshape(len(left), -1)
        del block, scaled, left  # before LAPACK works and the next block is made
        left, sigma = _left_factors(columns, rank, weighted_norm(centre, weights, shape[0]))
        del columns
    if times == 0:
        raise ValueError("snapshots: there is none in the blocks; record some or check the file.")
    left = left[:, : check_modes(modes, len(sigma), times)].reshape(*shape, -1)
    return Basis(modes=left / scale, centre=centre, weights=weights, singular_values=sigma)


def _centre_of_all(
    blocks: Iterable[np.ndarray], centring: Centring, fluid: Fluid
) -> Float[np.ndarray, "points fields"]:
    """The mean over all snapshots of the centres of their blocks."""
    if iter(blocks) is blocks:
        raise ValueError(
            "blocks: this centring goes through them twice, but they are an iterator, which goes "
            "by once; give a list, or an object whose __iter__ starts anew."
        )
    total, times, shape = 0.0, 0, None
    for block in blocks:
        _check_shape(block, shape)
        shape = block.shape[:2]
        if block.shape[2]:
            total = total + block.shape[2] * centring.centre(block, fluid)
            times += block.shape[2]
    return total / max(times, 1)


def _left_factors(
    columns: Float[np.ndarray, "rows columns"], rank: int | None, centre: float
) -> tuple[Float[np.ndarray, "rows kept"], Float[np.ndarray, " kept"]]:
    """U and Sigma of columns, up to the numerical rank and the rank wanted; columns are lost."""
    factor, core = scipy.linalg.qr(columns, mode="economic", overwrite_a=True)
    left, sigma, _ = scipy.linalg.svd(core, full_matrices=False)
    kept = numerical_rank(sigma, core.shape[1], centre)
    kept = kept if rank is None else min(kept, rank)
    return factor @ left[:, :kept], sigma[:kept]


def _check_wanted(modes: int | None, rank: int | None) -> None:
    if rank is not None and rank < 1:
        raise ValueError(f"rank: {rank} asked for; carry at least as many columns as modes.")
    if modes is not None and modes < 1:
        raise ValueError(f"modes: {modes} asked for; ask for at least 1 mode.")
    if modes is not None and rank is not None and modes > rank:
        raise ValueError(
            f"modes: {modes} asked for, but rank {rank} gives 1 to {rank}; "
            "ask for fewer modes or a higher rank."
        )


def _check_shape(block: np.ndarray, shape: tuple[int, ...] | None) -> None:
    if block.ndim != 3:
        raise ValueError(
            f"blocks: each is (points, fields, times), got one of shape {block.shape}; "
            "put a whole matrix into a list."
        )
    check_order(block)
    if shape is not None and block.shape[:2] != shape:
        raise ValueError(
            f"blocks: one has (points, fields) = {block.shape[:2]}, the first one {shape}; "
            "map all of them on the same reference points."
        )
