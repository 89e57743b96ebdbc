"""What is read off a reduced flow: forces on a body, or what else is linear in its fields."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsph import Trajectory
from jaxsph.compiled import full_precision

from .reduced_flow import mapped_run

if TYPE_CHECKING:
    from .trained_model import TrainedModel


class LinearOutput(eqx.Module):
    """y(a; theta) = c_0 + L_0 a + sum_k theta_k (c_k + L_k a).

    The force on a body has this form: its pressure is linear in the density, its viscous part in
    the velocity and in the viscosity, one of the coefficients theta. Pure: jit, vmap and
    differentiate it.

    Args:
        table: (c_k, L_k), the constant part first.

    Examples:
        >>> import jax.numpy as jnp
        >>> from jaxsph_rom.points import LinearOutput
        >>> coordinates = [jnp.asarray([[0.0], [1.0], [2.0]]), jnp.asarray([[0.0], [1.0], [3.0]])]
        >>> viscosity = [jnp.asarray([0.1]), jnp.asarray([0.2])]
        >>> forces = [v[0] * (1.0 + a) for a, v in zip(coordinates, viscosity)]
        >>> output = LinearOutput.fit(coordinates, viscosity, forces)
        >>> output(jnp.asarray([[5.0]]), jnp.asarray([0.3])).round(3)  # 0.3 (1 + 5)
        Array([[1.8]], dtype=...)
    """

    table: Float[Array, "monomials outputs modes_and_one"]

    @full_precision
    def __call__(
        self,
        coordinates: Float[Array, "*times modes"],
        values: Float[Array, " coefficients"],
    ) -> Float[Array, "*times outputs"]:
        """y at coordinates, theta the same for all.

        Raises:
            ValueError: if theta is of another number of coefficients than the table.
        """
        if values.shape != (len(self.table) - 1,):
            raise ValueError(
                f"values: {len(self.table) - 1} coefficients of one member, got shape "
                f"{values.shape}; give `prediction.values[k]`."
            )
        monomials = jnp.concatenate([jnp.ones(1, self.table.dtype), values])
        at = jnp.tensordot(monomials, self.table, 1)
        along = coordinates @ at[:, 1:].T
        return along + jnp.broadcast_to(at[:, 0], along.shape)

    @classmethod
    def fit(
        cls,
        coordinates: Sequence[Float[np.ndarray, "times modes"]],
        values: Sequence[Float[np.ndarray, " coefficients"]],
        outputs: Sequence[Float[np.ndarray, "times outputs"]],
        ridge: float = 1e-6,
    ) -> LinearOutput:
        """The table that is nearest in the least squares to what some runs gave.

        Args:
            coordinates, values, outputs: of each run.
            ridge: weight of the table's own square, each column scaled by its mean square.

        Raises:
            ValueError: if lists differ in length, or there are fewer times than numbers to find.
        """
        if not len(coordinates) == len(values) == len(outputs):
            raise ValueError(
                f"outputs: {len(outputs)} runs of them, {len(coordinates)} of coordinates and "
                f"{len(values)} of values; give one of each for every run."
            )
        columns = np.concatenate([_columns(a, v) for a, v in zip(coordinates, values, strict=True)])
        wanted = np.concatenate([np.asarray(y, float) for y in outputs])
        times, count = columns.shape
        if times < count:
            raise ValueError(
                f"outputs: {times} times for {count} numbers to find; give more snapshots, or a "
                "model of fewer modes."
            )
        scale = np.sqrt(np.mean(columns**2, axis=0))
        scale = np.where(scale > 0.0, scale, 1.0)
        ahead = np.concatenate([columns / scale, np.sqrt(ridge * times) * np.eye(count)])
        beside = np.concatenate([wanted, np.zeros((count, wanted.shape[1]))])
        found = np.linalg.lstsq(ahead, beside, rcond=None)[0] / scale[:, None]
        modes, dtype = np.shape(coordinates[0])[1], np.asarray(coordinates[0]).dtype
        table = found.T.reshape(wanted.shape[1], -1, 1 + modes).swapaxes(0, 1)
        return cls(jnp.asarray(table.astype(dtype)))


def _columns(coordinates, values) -> Float[np.ndarray, "times columns"]:
    ahead = np.concatenate([np.ones((len(coordinates), 1)), np.asarray(coordinates)], axis=1)
    monomials = np.concatenate([[1.0], np.atleast_1d(np.asarray(values, float))])
    return np.concatenate([m * ahead for m in monomials], axis=1)


def fit_forces(
    model: TrainedModel, runs: Sequence[Trajectory], part: str, ridge: float = 1e-6
) -> LinearOutput:
    """Forces [N] on a part of the walls, as an output of a model.

    From means between snapshots where the runs have them, which scatter least, else from those of
    the snapshots.

    Args:
        model: trained on the runs.
        runs: in the order of its training points.
        part: of the walls, by name.
        ridge: as of `LinearOutput.fit`.

    Raises:
        ValueError: if there are other than the model's number of runs, or they have no such part.
    """
    if len(runs) != len(model.points):
        raise ValueError(
            f"runs: {len(runs)} for {len(model.points)} training points; give those that the model "
            "was trained on, in their order."
        )
    coordinates, outputs = [], []
    for run in runs:
        known = run.mean_forces or run.forces
        if part not in known:
            names = ", ".join(known) or "none recorded"
            raise ValueError(f"part: {part!r} is not among the forces of the runs ({names}).")
        at = np.asarray(model.flow.project(mapped_run(model.flow.reference, run, model.flow.fluid)))
        force = np.asarray(known[part])
        averaged = bool(run.mean_forces)
        coordinates.append(0.5 * (at[1:] + at[:-1]) if averaged else at)
        outputs.append(force[1:] if averaged else force)
    values = [np.asarray(model.between(jnp.asarray(point))) for point in model.points]
    return LinearOutput.fit(coordinates, values, outputs, ridge)
