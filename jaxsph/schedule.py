"""The steps of a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Float


@final
@dataclass(frozen=True)
class Schedule:
    """Equal steps from time 0 on, and a snapshot after every so many of them.

    Args:
        time_step: dt [s].
        steps_per_snapshot: in an interval, from snapshot to snapshot.
        intervals: of the run; none for a start alone.

    Raises:
        ValueError: if the step is not above zero, the steps in an interval are none, or the
            intervals negative.

    Examples:
        >>> from jaxsph import Schedule
        >>> schedule = Schedule(time_step=0.01, steps_per_snapshot=5, intervals=4)
        >>> schedule.steps, schedule.times
        (20, array([0.  , 0.05, 0.1 , 0.15, 0.2 ]))
    """

    time_step: float
    steps_per_snapshot: int
    intervals: int

    def __post_init__(self):
        if not 0.0 < self.time_step < np.inf:
            raise ValueError(f"time_step: above zero and finite, got {self.time_step:g} s.")
        for name, least in (("steps_per_snapshot", 1), ("intervals", 0)):
            if getattr(self, name) < least:
                raise ValueError(f"{name}: at least {least}, got {getattr(self, name)}.")

    @classmethod
    def until(cls, end_time: float, time_step: float, steps_per_snapshot: int) -> Schedule:
        """As many intervals, one at least, as come nearest to an end [s]."""
        once = cls(time_step, steps_per_snapshot, 1)
        return cls(time_step, steps_per_snapshot, max(1, round(end_time / once.interval)))

    @property
    def steps(self) -> int:
        """Number of the last step."""
        return self.intervals * self.steps_per_snapshot

    @property
    def interval(self) -> float:
        """Time from snapshot to snapshot [s]."""
        return self.time_step * self.steps_per_snapshot

    @property
    def end_time(self) -> float:
        """Of the run [s]."""
        return self.steps * self.time_step

    @property
    def times(self) -> Float[np.ndarray, " snapshots"]:
        """Of the snapshots, the start's among them [s]."""
        return np.arange(self.intervals + 1) * self.steps_per_snapshot * self.time_step
