"""Runs of a reduced model at many parameters."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import equinox as eqx
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from jaxsph import Trajectory
from jaxsph.shown import concrete, line, spread, table

if TYPE_CHECKING:
    from .trained_model import TrainedModel


class Maker:
    """The model that made a prediction: known by its identity, so that it is structure under
    `jax.jit`.

    Args:
        model: a trained model.
    """

    def __init__(self, model: TrainedModel):
        self.model = model


class Prediction(eqx.Module):
    """A member for each set of parameters.

    Args:
        names: of the parameters (static).
        points: a row of them a member (K, n).
        values: theta of each member's operators.
        time: of the snapshots (S,) [s].
        coordinates: (K, S, M); NaN from a member's fault on.
        status: a `FaultCode` each, 0 for a good run (K,).
        step: that met the fault, -1 for a good run (K,).
        outside: whether a member is beyond the training points' range in a parameter, or the
            prediction goes on beyond their time (K,).
        start: where members start from: `given`; `family`, as `make` has it at these parameters;
            or `interpolated` between the training runs (static).
        operators: `family`, as `make` has them, or `interpolated` (static).
        maker: of it; none in a prediction of a file without its model (static).
        run_seconds, compile_seconds: wall-clock time of all members together [s] (static).
    """

    names: tuple[str, ...] = eqx.field(static=True)
    points: Float[Array, "members names"]
    values: Float[Array, "members coefficients"]
    time: Float[Array, " times"]
    coordinates: Float[Array, "members times modes"]
    status: Int[Array, " members"]
    step: Int[Array, " members"]
    outside: Bool[Array, " members"]
    start: str = eqx.field(static=True)
    operators: str = eqx.field(static=True)
    maker: Maker | None = eqx.field(static=True, default=None)
    indicated: Float[Array, " members"] | None = None
    run_seconds: float = eqx.field(static=True, default=float("nan"))
    compile_seconds: float = eqx.field(static=True, default=float("nan"))

    def __len__(self) -> int:
        return len(self.points)

    def _rows(self) -> dict[str, str] | None:
        if not concrete(self.points, self.coordinates, self.status, self.outside):
            return None
        count, times, size = self.coordinates.shape
        rows = {"members": str(count)}
        rows |= {name: spread(values, "").rstrip() for name, values in self.parameters.items()}
        rows |= {
            "coordinates": f"{size} at {times} times, {spread(self.time, 's')}",
            "start": self.start,
            "outside": str(int(np.sum(self.outside))),
            "lost": str(int(np.sum(np.asarray(self.status) != 0))),
        }
        known = self.__dict__.get("_indicated", self.indicated)  # not worked out to be shown
        if known is not None and concrete(known):
            rows["expected error"] = spread(100.0 * np.asarray(known), "%")
        return rows

    def __repr__(self):
        return line(self, self._rows())

    def _repr_html_(self):
        return table(self, self._rows())

    @property
    def parameters(self) -> dict[str, Float[Array, " members"]]:
        """Each parameter over the members."""
        return {name: self.points[:, k] for k, name in enumerate(self.names)}

    @property
    def error_indicator(self) -> Float[Array, " members"]:
        """The expected relative error of each member's velocity, as `Indicator` has it; NaN for a
        member that is lost. It is evaluated when it is first asked for."""
        return self._indicated

    @cached_property
    def _indicated(self):
        if self.indicated is not None:
            return self.indicated
        model = self._with_model()
        return model.indicate(self.points, self.values, self.time, self.coordinates)

    def fields(self, member: int = 0, points=None) -> Trajectory:
        """Fields of a member over time, as far as it is good.

        Args:
            member: its number.
            points: (P, n) [m]; the reference points if none are given.

        Raises:
            ValueError: if there is no member of that number, or the prediction is of a file and has
                no model.
        """
        count = self.coordinates.shape[0]
        if not -count <= member < count:
            raise ValueError(f"member: {member}; the prediction has {count}, from 0 on.")
        return self._with_model().fields(self, member, points)

    def good(self, member: int) -> int:
        """The number of a member's snapshots before its fault."""
        lost = np.isnan(np.asarray(self.coordinates[member])).any(axis=-1)
        return int(np.argmax(np.append(lost, True)))

    def _with_model(self) -> TrainedModel:
        if self.maker is None:
            raise ValueError("model: the prediction has none; load it with model=... as well.")
        return self.maker.model
