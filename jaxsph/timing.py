"""What a run took."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, final


@final
@dataclass(frozen=True)
class Timing:
    """What a run took, or its last part if it was taken up again.

    Args:
        steps: number of time steps.
        time_step: dt [s].
        run_seconds: wall-clock time without compilation [s].
        compile_seconds: wall-clock time of compilation [s].
        enlarged_at: steps at which the neighbour list was given more room.
    """

    steps: int
    time_step: float
    run_seconds: float
    compile_seconds: float
    enlarged_at: tuple[int, ...] = ()

    @classmethod
    def of(cls, metadata: Mapping[str, Any]) -> Timing:
        """The record in a trajectory's metadata.

        Raises:
            ValueError: if these are not those of a run.
        """
        needed = ("steps", "time_step", "run_seconds", "compile_seconds")
        missing = [name for name in needed if name not in metadata]
        if missing:
            raise ValueError(
                f"metadata: no {', '.join(missing)}, so that what the run took is not known; only "
                "trajectories that `simulate` or `run_scene` made, and their files, tell it."
            )
        given = {name: metadata[name] for name in needed}
        return cls(**given, enlarged_at=tuple(metadata.get("enlarged_at", ())))

    def seconds(self, steps: int) -> float:
        """Run time of so many steps [s], at the pace of these."""
        return self.run_seconds * steps / self.steps

    def metadata(self) -> dict[str, Any]:
        """The record as a trajectory's metadata hold it."""
        return asdict(self) | {"enlarged_at": list(self.enlarged_at)}
