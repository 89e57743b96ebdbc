"""What is studied of each scene unless the user says otherwise."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Plan:
    """Reynolds numbers, modes and how runs are judged.

    Args:
        train, predict: Reynolds numbers to train on and to run at.
        modes: numbers of modes.
        tau: memory length of the adjoint Petrov-Galerkin projection [s].
        borders: of local bases over the Reynolds number; one global basis if none are given.
        slice_at: x of the vertical line of probes [m]; the centre line if none is given.
        judged_from: time from which on discrepancies count [s].
        settling: time [s] that a run from rest takes before the studied time begins.
    """

    train: tuple[float, ...]
    predict: tuple[float, ...]
    modes: tuple[int, ...]
    tau: float
    borders: tuple[float, ...] | None = None
    slice_at: float | None = None
    judged_from: float = 0.0
    settling: float | None = None


_DECAYING = Plan((100.0, 150.0, 200.0, 250.0), (125.0, 175.0, 225.0), (3,), 1e-4)
PLANS = {
    "taylor-green": _DECAYING,
    "taylor-green-3d": _DECAYING,
    "lid-driven-cavity": Plan(
        (50.0, 100.0, 150.0, 200.0),
        (75.0, 125.0, 175.0),
        (15,),
        1e-7,
        borders=(50.0, 100.0, 150.0, 200.0),
        judged_from=1.0,  # before, pressure is that of sound from the lid's sudden start
    ),
    "open-cavity": Plan((2400.0,), (2400.0,), (20,), 1e-7, slice_at=0.25, settling=5.0),
}
