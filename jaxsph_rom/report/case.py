"""One reduced run beside its full model: what it got wrong and what it cost."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from .plain import plain


@dataclasses.dataclass(frozen=True, kw_only=True)
class Case:
    """A reduced model compared with the full model of the same scene and Reynolds number.

    A value that was not measured is None. A value that is NaN or infinite is a failed run: the
    case then counts as unstable, whatever `stable` says.

    Args:
        scene: the scene's name.
        reynolds: Re = U L / nu.
        modes: number of modes M.
        projection: `galerkin` or `apg`.
        tau: memory length of the adjoint Petrov-Galerkin projection [s]; None for Galerkin.
        inner_product: `euclidean` or `energy`.
        hyper: hyper-reduction, `none`, or `tensor` and what was added to it.
        trained_on: Reynolds numbers whose snapshots made the basis.
        velocity_peak_percent, velocity_median_percent: relative discrepancy of the velocity norm,
            largest and median over time [%].
        pressure_peak_percent, pressure_median_percent: the same of the pressure [%]; None where
            it is uniform but for particles' noise, and has no range that an error is relative to.
        stable: whether the run reached its end with bounded fields and nothing to doubt.
        fom_seconds, rom_seconds: wall-clock time of the full and the reduced run without
            compilation [s].
        fom_steps, rom_steps: number of time steps in them.
        fom_compile_seconds, rom_compile_seconds: wall-clock time of compilation [s].
        compression_factor: N_d / M, numbers of the full state per reduced coordinate.
        memory: rule and constant that gave tau, `auto-0.2` say; None where it was given itself.
        training_seconds: run time of the full runs that it was trained on [s].
        offline_seconds: wall-clock time in which it was made of them, its closure's training
            included [s].
        fault: why it is unstable, or None.
        fault_time: simulated time at which it failed [s], or None.
        doubt: why it is not to be believed though it went on, or None.
        doubt_time: simulated time from which on that is so [s], or None.
        pressure_peak_pascal, pressure_median_pascal: mean absolute discrepancy of the pressure over
            the places, largest and median over time [Pa].
    """

    scene: str
    reynolds: float
    modes: int
    projection: str
    tau: float | None
    inner_product: str
    hyper: str
    trained_on: tuple[float, ...]
    velocity_peak_percent: float | None
    velocity_median_percent: float | None
    pressure_peak_percent: float | None
    pressure_median_percent: float | None
    stable: bool
    fom_seconds: float | None
    rom_seconds: float | None
    fom_steps: int | None
    rom_steps: int | None
    fom_compile_seconds: float | None
    rom_compile_seconds: float | None
    compression_factor: float | None
    memory: str | None = None
    training_seconds: float | None = None
    offline_seconds: float | None = None
    fault: str | None = None
    fault_time: float | None = None
    doubt: str | None = None
    doubt_time: float | None = None
    pressure_peak_pascal: float | None = None
    pressure_median_pascal: float | None = None

    @property
    def sound(self) -> bool:
        """`stable`, and no value is NaN or infinite."""
        values = (getattr(self, field.name) for field in dataclasses.fields(self))
        return bool(self.stable) and all(map(_finite, values))

    @property
    def uniform_pressure(self) -> bool:
        """Whether there was no pressure to compare with; its discrepancy in pascal is there."""
        return self.pressure_peak_percent is None and self.pressure_peak_pascal is not None

    @property
    def predicted(self) -> bool:
        """Whether the basis has not seen this Reynolds number."""
        return not any(math.isclose(self.reynolds, trained) for trained in self.trained_on)

    @property
    def time_ratio(self) -> float | None:
        """fom_seconds / rom_seconds: above 1 the reduced run is the faster one.

        None where either time is missing, and for a run that failed: its time is not one of a
        whole run.
        """
        if not self.sound or not self.fom_seconds or not self.rom_seconds:
            return None
        return self.fom_seconds / self.rom_seconds

    def to_dict(self) -> dict[str, Any]:
        """The fields as strict JSON can hold them: None for NaN and infinity, `stable` then false.

        `Case(**case.to_dict())` gives the case back, but for `trained_on`, which is a list.
        """
        values = {
            field.name: plain(getattr(self, field.name)) for field in dataclasses.fields(self)
        }
        return values | {"stable": self.sound}


def _finite(value: Any) -> bool:
    if value is None or isinstance(value, str | tuple | list):
        return True
    return math.isfinite(value)
