"""Runs of a model on labels at many parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, final

import equinox as eqx
import numpy as np
from jaxtyping import Bool, Float, Int

from jaxsph import Trajectory
from jaxsph.shown import line, spread, table

from .mixing import mixed_from

if TYPE_CHECKING:
    from .label_model import LabelModel


@final
class LabelPrediction(eqx.Module):
    """A member for each set of parameters.

    Args:
        model: that made it.
        points: a row of parameters a member (K, n).
        values: theta of each.
        time: of the snapshots (S,) [s].
        coordinates: (K, S, M); NaN from a member's fault on.
        status: a `FaultCode` each, 0 for a good run (K,).
        step: that met the fault, -1 for a good run (K,).
        outside: whether a member is beyond the training points' range in a parameter, or the
            prediction goes on beyond their time (K,).
        run_seconds, compile_seconds: wall-clock time of all members together [s] (static).
    """

    model: LabelModel
    points: Float[np.ndarray, "members names"]
    values: Float[np.ndarray, "members coefficients"]
    time: Float[np.ndarray, " times"]
    coordinates: Float[np.ndarray, "members times modes"]
    status: Int[np.ndarray, " members"]
    step: Int[np.ndarray, " members"]
    outside: Bool[np.ndarray, " members"]
    run_seconds: float = eqx.field(static=True)
    compile_seconds: float = eqx.field(static=True)

    def __len__(self) -> int:
        return len(self.points)

    @property
    def parameters(self) -> dict[str, Float[np.ndarray, " members"]]:
        """Each parameter over the members."""
        return {name: self.points[:, k] for k, name in enumerate(self.model.names)}

    def good(self, member: int) -> int:
        """The number of a member's snapshots before its fault."""
        lost = ~np.isfinite(self.coordinates[member]).all(axis=-1)
        return int(np.argmax(np.append(lost, True)))

    def fields(self, member: int = 0) -> Trajectory:
        """A member's particles over time, as far as it is good.

        Raises:
            ValueError: if there is no member of that number.
        """
        if not -len(self) <= member < len(self):
            raise ValueError(f"member: {member}; the prediction has {len(self)}, from 0 on.")
        count = self.good(member)
        return self.model.fields(
            self.time[:count], self.coordinates[member, :count], self.values[member]
        )

    def mixed_from(self, member: int = 0) -> float | None:
        """When the member's labels mix [s], if they do (`jaxsph_rom.labels.mixed_from`)."""
        return mixed_from(self.fields(member), self.model.space) if self.good(member) else None

    def strayed_from(self, member: int = 0) -> float | None:
        """When particles that are not followed first come within the kernel's support of one of the
        member's samples [s], if they do: from then on its rates lack them. Neighbours' neighbours
        are not looked at. None for a model without samples."""
        run, model = self.fields(member), self.model
        strayed = model.system.strayed(run.position, model.labels, model.space)
        return float(run.time[int(np.argmax(strayed))]) if strayed.any() else None

    def _rows(self) -> dict[str, str]:
        rows = {"members": str(len(self))}
        rows |= {name: spread(values, "").rstrip() for name, values in self.parameters.items()}
        return rows | {
            "coordinates": f"{self.coordinates.shape[2]} at {len(self.time)} times, "
            f"{spread(self.time, 's')}",
            "outside": str(int(np.sum(self.outside))),
            "lost": str(int(np.sum(self.status != 0))),
        }

    def __repr__(self):
        return line(self, self._rows())

    def _repr_html_(self):
        return table(self, self._rows())
