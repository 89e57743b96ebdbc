"""Exact solutions of flows between parallel plates, started from rest (Morris et al. 1997)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Float

_TERMS = 400  # of the series; exp(-(n pi)^2 nu t) makes all but the first few vanish


def couette(
    height: Float[np.ndarray, " points"], time: float, viscosity: float
) -> Float[np.ndarray, " points"]:
    """u(y, t) [m/s] between a plate at rest at y = 0 and one at y = H = 1 m that slides with 1 m/s:

        u = y + sum_n 2 (-1)^n / (n pi) sin(n pi y) exp(-nu n^2 pi^2 t),

    the sum up to n = 400; at t = 0, where that is not enough, rest.
    """
    if time == 0.0:
        return np.zeros_like(height)
    n = np.arange(1, _TERMS + 1)[:, None]
    y = np.asarray(height)[None, :]
    terms = 2.0 * (-1.0) ** n / (n * np.pi) * np.sin(n * np.pi * y)
    return y[0] + (terms * np.exp(-viscosity * (n * np.pi) ** 2 * time)).sum(axis=0)


def poiseuille(
    height: Float[np.ndarray, " points"], time: float, viscosity: float, force: float
) -> Float[np.ndarray, " points"]:
    """u(y, t) [m/s] between plates at rest at y = 0 and H = 1 m under a force b [m/s^2]:

        u = b y (1 - y) / (2 nu)
            - sum_{n odd} 4 b / (nu (n pi)^3) sin(n pi y) exp(-nu n^2 pi^2 t),

    the sum up to n = 400.
    """
    n = np.arange(1, _TERMS + 1, 2)[:, None]
    y = np.asarray(height)[None, :]
    terms = 4.0 * force / (viscosity * (n * np.pi) ** 3) * np.sin(n * np.pi * y)
    steady = 0.5 * force / viscosity * y[0] * (1.0 - y[0])
    return steady - (terms * np.exp(-viscosity * (n * np.pi) ** 2 * time)).sum(axis=0)


@final
@dataclass(frozen=True)
class CouetteFlow:
    """`couette` as velocity (N, 2) [m/s] and pressure (N,) [Pa], zero, at positions (N, 2) [m].

    Args:
        viscosity: nu [m^2/s].
    """

    viscosity: float

    def __call__(self, position, time):
        return _along(couette(position[:, 1], time, self.viscosity))


@final
@dataclass(frozen=True)
class PoiseuilleFlow:
    """`poiseuille` as velocity (N, 2) [m/s] and pressure (N,) [Pa], zero, at positions (N, 2) [m].

    Args:
        viscosity: nu [m^2/s].
        force: b [m/s^2].
    """

    viscosity: float
    force: float

    def __call__(self, position, time):
        return _along(poiseuille(position[:, 1], time, self.viscosity, self.force))


def _along(speed):
    rest = np.zeros_like(speed)
    return np.stack([speed, rest], axis=1), rest
