"""Proper orthogonal decomposition."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jaxtyping import Array, Float

from jaxsph import Fluid
from jaxsph.shown import concrete, line, table

from .centring import Centring
from .inner_product import InnerProduct


class Basis(eqx.Module):
    """Modes on fixed points, orthonormal in their inner product, and all singular values.

    Args:
        modes: (G, F, M); field 0 is density [kg/m^3 per unit coordinate], then velocity.
        centre: (G, F) state about which the modes are taken, (1, F) if it is the same everywhere.
        weights: (F,) of the inner product.
        singular_values: of the whole snapshot matrix, those of the modes first.
    """

    modes: Float[np.ndarray, "points fields modes"]
    centre: Float[np.ndarray, "#points fields"]
    weights: Float[np.ndarray, " fields"]
    singular_values: Float[np.ndarray, " snapshots"]

    @property
    def size(self) -> int:
        return self.modes.shape[2]

    def truncated(self, modes: int) -> Basis:
        """The first `modes` modes.

        Raises:
            ValueError: if there are not so many.
        """
        if not 1 <= modes <= self.size:
            raise ValueError(
                f"modes: {modes} asked for, but the snapshots give 1 to {self.size}; "
                "ask for fewer modes or record more snapshots."
            )
        return eqx.tree_at(lambda b: b.modes, self, self.modes[:, :, :modes])

    def _rows(self) -> dict[str, str] | None:
        if not concrete(self.modes, self.singular_values):
            return None
        points, fields, modes = self.modes.shape
        energy = cumulative_energy(self.singular_values)[min(modes, len(self.singular_values)) - 1]
        return {
            "modes": f"{modes} of {len(self.singular_values)}",
            "points": f"{points} in {fields - 1}D",
            "energy": f"{energy:.6g} %",
        }

    def __repr__(self):
        return line(self, self._rows())

    def _repr_html_(self):
        return table(self, self._rows())

    @property
    def functions(self) -> Float[np.ndarray, "points fields functions"]:
        """What is carried to other points: the modes, and behind them a centre that varies."""
        if len(self.centre) == 1:
            return self.modes
        return np.concatenate([self.modes, self.centre[:, :, None]], axis=2)

    def parts(
        self, functions: Float[Array, "places fields functions"]
    ) -> tuple[Float[Array, "places fields modes"], Float[Array, "#places fields"]]:
        """Modes and centre at the places where `functions` were carried to."""
        if len(self.centre) == 1:
            return functions, self.centre
        return functions[:, :, :-1], functions[:, :, -1]

    def combination(
        self, coordinates: Float[Array, " modes"]
    ) -> tuple[Float[Array, "functions fields"], Float[Array, "1 fields"]]:
        """Two matrices: fields = functions @ first + second, functions being (field, function)."""
        count = self.modes.shape[1]
        each = jnp.eye(count, dtype=coordinates.dtype)
        if len(self.centre) == 1:
            ahead, rest = coordinates, jnp.asarray(self.centre, coordinates.dtype)
        else:
            ahead = jnp.append(coordinates, jnp.ones_like(coordinates[:1]))
            rest = jnp.zeros((1, count), coordinates.dtype)
        return jnp.einsum("fg,m->fmg", each, ahead).reshape(-1, count), rest


def pod(
    snapshots: Float[np.ndarray, "points fields times"],
    product: InnerProduct,
    fluid: Fluid,
    modes: int | None = None,
    centring: Centring | None = None,
) -> Basis:
    """POD of snapshots by singular value decomposition (paper, eq. SVD), in an inner product.

    Args:
        snapshots: (G, F, S), density first.
        product: `Euclidean()` is the paper's.
        fluid: gives the product its scales.
        modes: how many to keep; as many as the numerical rank if none is given.
        centring: the product's own if none is given.

    Raises:
        ValueError: if the snapshots are none, in another order, all the centre, of a lower rank
            than modes are asked for, or not finite.

    Examples:
        >>> import numpy as np
        >>> from jaxsph import Fluid
        >>> from jaxsph_rom import Energy, pod
        >>> fluid = Fluid(reference_density=1000.0, sound_speed=10.0, reference_speed=1.0)
        >>> x, t = np.linspace(0.0, 1.0, 50), np.linspace(0.0, 1.0, 9)
        >>> wave = np.sin(2.0 * np.pi * (x[:, None] - t))  # a travelling wave has two modes
        >>> snapshots = np.stack([1000.0 + wave, 0.0 * wave, 0.1 * wave], axis=1)
        >>> basis = pod(snapshots, Energy(), fluid, modes=2)
        >>> basis.modes.shape  # points, fields (density and velocity), modes
        (50, 3, 2)
        >>> bool(basis.singular_values[2] < 1e-6 * basis.singular_values[0])
        True
    """
    points, fields, times = check_snapshots(snapshots)
    scaled, centre, weights = weighted_fluctuations(snapshots, product, fluid, centring)
    matrix = scaled.reshape(points * fields, times)
    left, sigma, _ = scipy.linalg.svd(matrix, full_matrices=False, overwrite_a=True)
    rank = numerical_rank(sigma, times, weighted_norm(centre, weights, points))
    count = check_modes(modes, rank, times)
    left = left[:, :count].reshape(points, fields, -1)
    left /= np.sqrt(weights)[None, :, None]
    return Basis(modes=left, centre=centre, weights=weights, singular_values=sigma)


def check_snapshots(snapshots: Float[np.ndarray, "points fields times"]) -> tuple[int, int, int]:
    """The numbers of points, fields and times.

    Raises:
        ValueError: for another order of axes, or none of one.
    """
    check_order(snapshots)
    if 0 in snapshots.shape:
        raise ValueError(f"snapshots: there is none in {snapshots.shape}; record some.")
    return snapshots.shape


def check_order(snapshots: np.ndarray) -> None:
    """Raise a ValueError unless the axes can be points, fields and times."""
    if snapshots.ndim != 3 or snapshots.shape[1] not in (3, 4):
        raise ValueError(
            f"snapshots: their shape is {snapshots.shape}; give (points, fields, times), the "
            "fields being density and the components of velocity (np.moveaxis(a, 0, -1) where "
            "times are first)."
        )


def numerical_rank(sigma: Float[np.ndarray, " k"], columns: int, centre: float) -> int:
    """How many singular values are more than round-off: that of the decomposition,

        sigma > columns eps sigma_1   (as numpy's matrix_rank),

    and that of the fields from which a centre was subtracted, sigma > 4 eps |centre|, its weighted
    norm over all points.
    """
    noise = np.finfo(sigma.dtype).eps * np.maximum(columns * sigma[:1], 4.0 * centre)
    return int(np.count_nonzero(sigma > noise))


def weighted_norm(centre: Float[np.ndarray, "#points fields"], weights, points: int) -> float:
    """sqrt(sum w_f c_f^2) over all points."""
    repeated = points / len(centre)
    return float(np.sqrt(repeated * np.sum(centre**2 * np.asarray(weights)[None, :])))


def check_modes(modes: int | None, rank: int, times: int) -> int:
    """The number of modes to keep, all if none is given.

    Raises:
        ValueError: if there are not so many, or none at all.
    """
    if rank == 0:
        raise ValueError(
            f"snapshots: all {times} are the centre, which has no modes; record a longer run."
        )
    if modes is not None and not 1 <= modes <= rank:
        raise ValueError(
            f"modes: {modes} asked for, but {times} snapshots give 1 to {rank}; "
            "ask for fewer modes or record more snapshots."
        )
    return rank if modes is None else modes


def weighted_fluctuations(
    snapshots: Float[np.ndarray, "points fields times"],
    product: InnerProduct,
    fluid: Fluid,
    centring: Centring | None,
) -> tuple[
    Float[np.ndarray, "points fields times"],
    Float[np.ndarray, "#points fields"],
    Float[np.ndarray, " fields"],
]:
    """sqrt(w_f) (snapshots - centre), whose plain product is the inner product; centre and w_f.

    Raises:
        ValueError: if a value is not finite.
    """
    if not np.isfinite(snapshots).all():
        raise ValueError("snapshots: a value is not finite; the full model's run has failed.")
    centring = product.centring if centring is None else centring
    centre = centring.centre(snapshots, fluid)
    weights = np.asarray(product.weights(fluid, snapshots.shape[1] - 1))
    scaled = (snapshots - centre[:, :, None]) * np.sqrt(weights)[None, :, None]
    return scaled, centre, weights


def cumulative_energy(singular_values: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
    """Percent cumulative energy 100 sum_{i<=M} sigma_i / sum_i sigma_i for M = 1, 2, ... (paper).

    A sum of sigma, not of sigma squared.
    """
    sigma = np.asarray(singular_values, dtype=float)
    return 100.0 * np.cumsum(sigma) / np.sum(sigma)
