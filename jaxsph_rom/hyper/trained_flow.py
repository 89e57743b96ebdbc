"""A reduced flow with all that it takes to run it at any Reynolds number."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Float

from jaxsph import Trajectory

from .prediction import Prediction
from .reduced_flow import ReducedFlow
from .sweep import sweep


class TrainedFlow(eqx.Module):
    """A `ReducedFlow`, where its runs start and how they are stepped.

    The start at a viscosity is interpolated linearly between those of the training runs, mode by
    mode, and is that of the nearest run outside their range.

    Args:
        flow: basis and system.
        viscosities: of the training runs, increasing (R,) [m^2/s].
        starts: coordinates at their start (R, M).
        speed_times_length: U L = Re nu [m^2/s].
        time_step: dt [s].
        steps_per_snapshot: between snapshots.
        snapshots: intervals between snapshots in a training run.
        scene: name of the scene.
        parameters: of the scene, JSON-like.
        training: how it was trained, what that cost and what errors are left, JSON-like.

    Examples:
        >>> import numpy as np
        >>> import jaxsph
        >>> from jaxsph.arrangements import Lattice
        >>> from jaxsph_rom.hyper import load_flow, save_flow, train_flows
        >>> scenes = [
        ...     jaxsph.scenes.taylor_green(16, reynolds, end_time=0.06, arrangement=Lattice())
        ...     for reynolds in (100.0, 200.0)
        ... ]
        >>> runs = [jaxsph.run_scene(scene) for scene in scenes]
        >>> (trained,) = train_flows(scenes, runs, modes=[2])
        >>> save_flow("model.h5", trained)
        >>> prediction = load_flow("model.h5").predict(np.linspace(100.0, 200.0, 1000))
        >>> prediction.coordinates.shape  # members, times, modes
        (1000, 4, 2)
        >>> trained.fields(prediction, member=500).velocity.shape  # times, points, directions
        (4, 256, 2)
    """

    flow: ReducedFlow
    viscosities: Float[np.ndarray, " runs"]
    starts: Float[np.ndarray, "runs modes"]
    speed_times_length: float = eqx.field(static=True)
    time_step: float = eqx.field(static=True)
    steps_per_snapshot: int = eqx.field(static=True)
    snapshots: int = eqx.field(static=True)
    scene: str = eqx.field(static=True)
    parameters: dict[str, Any] = eqx.field(static=True)
    training: dict[str, Any] = eqx.field(static=True)

    def __check_init__(self):
        if not (np.diff(self.viscosities) > 0.0).all() or not (self.viscosities > 0.0).all():
            raise ValueError(
                f"viscosities: must be positive and increase, got {list(self.viscosities)}."
            )

    @property
    def reynolds(self) -> Float[np.ndarray, " runs"]:
        """Reynolds numbers of the training runs, increasing."""
        return self.speed_times_length / self.viscosities[::-1]

    @property
    def interval(self) -> float:
        """Time between two snapshots [s]."""
        return self.time_step * self.steps_per_snapshot

    @property
    def end_time(self) -> float:
        """End of the training runs [s]."""
        return self.interval * self.snapshots

    def start(
        self, viscosities: Float[np.ndarray, " members"]
    ) -> Float[np.ndarray, "members modes"]:
        """Coordinates at the start of runs of these viscosities."""
        columns = [np.interp(viscosities, self.viscosities, mode) for mode in self.starts.T]
        return np.stack(columns, axis=-1).astype(self.starts.dtype)

    def intervals_to(self, end_time: float) -> int:
        """The number of snapshot intervals to a time [s].

        Raises:
            ValueError: if it is not a whole, positive number.
        """
        count = end_time / self.interval
        whole = round(count)
        if whole < 1 or abs(count - whole) > 1e-6 * whole:
            nearest = max(1, whole) * self.interval
            raise ValueError(
                f"t-end: {end_time:g} s is no whole number of snapshot intervals of "
                f"{self.interval:g} s; the nearest is {nearest:g} s."
            )
        return whole

    def predict(
        self,
        reynolds: Float[np.ndarray, " members"],
        snapshots: int | None = None,
        progress: Callable[[int], None] | None = None,
    ) -> Prediction:
        """Run at Reynolds numbers, all by one `sweep`.

        Args:
            reynolds: Re = U L / nu, any number of them.
            snapshots: intervals; as many as the training runs have if none is given.
            progress: is called with the number of members done since its last call.

        Raises:
            ValueError: if a Reynolds number is not positive, or there is none.
        """
        reynolds = np.atleast_1d(np.asarray(reynolds, float))
        if not ((reynolds > 0.0) & np.isfinite(reynolds)).all():
            raise ValueError("reynolds: must be positive and finite; leave out those that are not.")
        snapshots = self.snapshots if snapshots is None else snapshots
        viscosities = self.speed_times_length / reynolds
        starts = self.start(viscosities)
        found = sweep(
            self.flow, starts, viscosities, self.time_step, self.steps_per_snapshot, snapshots,
            progress=progress,
        )  # fmt: skip
        return Prediction(
            reynolds,
            self.interval * np.arange(snapshots + 1),
            np.concatenate([starts[:, None], found.coordinates], axis=1),
            found.code,
            found.step,
            found.run_seconds,
            found.compile_seconds,
        )

    def fields(self, prediction: Prediction, member: int, points=None) -> Trajectory:
        """Fields of a member over time, as far as it is good; `points` as in `ReducedFlow`."""
        count = prediction.good(member)
        return self.flow.fields(
            prediction.coordinates[member, :count], prediction.time[:count], points
        )
