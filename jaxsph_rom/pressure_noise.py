"""What range of pressure is particles' noise."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from jaxsph import Fluid

_PART = 0.01  # of rho0 U^2


def pressure_noise(fluid: Fluid) -> float:
    """0.01 rho0 U^2 [Pa], U the reference speed: a pressure whose range is below that, as between
    two plates, is uniform but for particles' noise, and no error is relative to it."""
    return _PART * float(fluid.reference_density) * float(fluid.reference_speed) ** 2


def is_noise(pressure: Float[np.ndarray, "times places"], fluid: Fluid) -> bool:
    """Whether the range of a pressure [Pa] over the places is no more than that at any time."""
    return bool(np.ptp(pressure, axis=1).max() <= pressure_noise(fluid))
