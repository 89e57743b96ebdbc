"""A reduced run watched as it goes: whether its pressure is one that training runs have."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Float

from jaxsph import Fluid, Snapshot

from ..basis import Basis
from ..pressure_noise import pressure_noise

OFF = 100.0  # percent: a pressure that is off by its own range says nothing


@final
@dataclass(frozen=True)
class TrainedPressure:
    """How far a run's pressure is from that of the training runs, at the reference points:

        e(t) = min_k 100 <|p - p_k(t)|> / range p_k(t),

    p_k the k-th training run's projection on the modes, and the range at least 0.01 rho0 U^2, so
    that a pressure that is uniform but for noise counts as one. The run's own error, which is not
    known as it goes, differs from e by no more than the true pressure does from the nearest p_k.

    Args:
        basis: of the run's model.
        fluid: gives the pressure.
        runs: time (T,) [s], coordinates (T, M) and range of pressure (T,) [Pa] of each.
    """

    basis: Basis
    fluid: Fluid
    runs: tuple[tuple[np.ndarray, np.ndarray, np.ndarray], ...]

    @classmethod
    def of(
        cls,
        basis: Basis,
        fluid: Fluid,
        runs: Iterable[
            tuple[Float[np.ndarray, " times"], Float[np.ndarray, "points fields times"]]
        ],
    ) -> TrainedPressure:
        """From the times of training runs and their snapshots on the reference points."""
        modes = np.asarray(basis.modes) * np.asarray(basis.weights)[:, None]
        flat, made = modes.reshape(-1, modes.shape[2]), []
        least = pressure_noise(fluid)
        for time, snapshots in runs:
            away = snapshots - np.asarray(basis.centre)[:, :, None]
            spread = np.ptp(np.asarray(fluid.pressure(snapshots[:, 0])), axis=0)
            made.append((time, away.reshape(len(flat), -1).T @ flat, np.maximum(spread, least)))
        return cls(basis, fluid, tuple(made))

    def percent(self, time: float, coordinates: Float[np.ndarray, " modes"]) -> float:
        """e(t); infinite for coordinates that are not finite."""
        found, nearest = self._pressure(coordinates), np.inf
        for times, trained, spread in self.runs:
            there = self._pressure([np.interp(time, times, each) for each in trained.T])
            apart = np.mean(np.abs(found - there)) / np.interp(time, times, spread)
            nearest = min(nearest, 100.0 * apart)
        return float(nearest)

    def __call__(self, time: float, snapshot: Snapshot) -> str | None:
        """What is wrong with a snapshot of the run, if pressure is off by more than its range."""
        percent = self.percent(time, snapshot.coordinates)
        if percent <= OFF:
            return None
        return f"pressure is off that of every training run by {percent:.0f} % of its range"

    def _pressure(self, coordinates) -> Float[np.ndarray, " points"]:
        centre, modes = np.asarray(self.basis.centre)[:, 0], np.asarray(self.basis.modes)[:, 0]
        density = (centre + modes @ np.asarray(coordinates)).astype(centre.dtype)
        return np.asarray(self.fluid.pressure(density))
