"""Sizes at which a scene is run."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Scale:
    """Resolution (particles per unit of the longest side), h/dx, dt [s] and steps per snapshot."""

    resolution: int
    h_over_dx: float
    time_step: float
    steps_per_snapshot: int

    def with_overrides(
        self,
        end_time: float,
        resolution: int | None,
        h_over_dx: float | None,
        time_step: float | None,
        longest_step: Callable[[Scale], float] | None = None,
    ) -> Scale:
        """This scale with what is given changed.

        Unless dt is given, dt / dx is kept at most, dt is below `longest_step` of the new scale if
        that is given, and dt divides the end time [s].

        Raises:
            ValueError: if a value is out of range.
        """
        new = self
        if resolution is not None:
            if resolution < 1:
                raise ValueError(f"resolution: at least 1 particle, got {resolution}.")
            step = self.time_step * self.resolution / resolution
            new = replace(new, resolution=int(resolution), time_step=step)
        if h_over_dx is not None:
            if not h_over_dx >= 1.0:
                raise ValueError(f"h_over_dx: at least 1, got {h_over_dx:g}.")
            new = replace(new, h_over_dx=float(h_over_dx))
        if time_step is not None:
            return replace(new, time_step=float(time_step))
        if longest_step is not None:
            new = replace(new, time_step=min(new.time_step, longest_step(new)))
        intervals = max(1, math.ceil(end_time / (new.time_step * new.steps_per_snapshot) - 1e-9))
        return replace(new, time_step=end_time / (intervals * new.steps_per_snapshot))
