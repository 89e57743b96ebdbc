"""A half-submerged sphere that is let go above its place in water without end, by linear theory."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# Hulme, J. Fluid Mech. 121 (1982) 443: of a heaving hemisphere in deep water, k a = w^2 a / g,
# added mass and damping over w, both over the displaced mass 2/3 pi rho a^3.
WAVE_NUMBER = np.array(
    [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0, 4.0,
     5.0, 6.0, 7.0, 8.0, 9.0, 10.0]
)  # fmt: skip
ADDED_MASS = np.array(
    [0.8764, 0.8627, 0.7938, 0.7157, 0.6452, 0.5861, 0.5381, 0.4999, 0.4698, 0.4464, 0.4284, 0.4047,
     0.3924, 0.3871, 0.3864, 0.3884, 0.3988, 0.4111, 0.4322, 0.4471, 0.4574, 0.4647, 0.4700, 0.4740,
     0.4771]
)  # fmt: skip
DAMPING = np.array(
    [0.1036, 0.1816, 0.2793, 0.3254, 0.3410, 0.3391, 0.3271, 0.3098, 0.2899, 0.2691, 0.2484, 0.2096,
     0.1756, 0.1469, 0.1229, 0.1031, 0.0674, 0.0452, 0.0219, 0.0116, 0.0066, 0.0040, 0.0026, 0.0017,
     0.0012]
)  # fmt: skip
ADDED_MASS_AT_ONCE = 0.5  # of motions so fast that no wave follows
_FREQUENCIES = np.linspace(0.0, 10.0**0.5, 2001)  # w (a / g)^1/2, to the table's last
_STEPS = 4000


class Heave(NamedTuple):
    """A sphere of half the water's density.

    Args:
        radius: a [m].
        gravity: g [m/s^2].
    """

    radius: float
    gravity: float

    def height(self, time: np.ndarray, lift: float) -> np.ndarray:
        """Above its place [m] at times [s] that rise from zero, let go from rest at `lift` [m]:

            (1 + 1/2) z'' + int_0^t K(t - s) z'(s) ds + (3/2) z = 0 (Cummins 1962)

        in units of a, g and the displaced mass, K(t) = 2/pi int w b(w) cos(w t) dw of the damping.
        The trapezoidal rule in 4000 steps, second-order.
        """
        unit = (self.radius / self.gravity) ** 0.5
        t = np.linspace(0.0, time[-1] / unit, _STEPS + 1)
        dt, memory = t[1], retardation(t)
        z, v, a = (np.zeros_like(t) for _ in range(3))
        z[0], a[0] = 1.0, -1.5 / (1.0 + ADDED_MASS_AT_ONCE)
        own = 1.0 + ADDED_MASS_AT_ONCE + 0.25 * dt**2 * memory[0] + 1.5 * 0.25 * dt**2
        for k in range(1, len(t)):
            passed = dt * (memory[k:0:-1] @ v[:k] - 0.5 * memory[k] * v[0])
            drift = v[k - 1] + 0.5 * dt * a[k - 1]
            ahead = z[k - 1] + dt * v[k - 1] + 0.25 * dt**2 * a[k - 1]
            a[k] = -(passed + 0.5 * dt * memory[0] * drift + 1.5 * ahead) / own
            v[k] = drift + 0.5 * dt * a[k]
            z[k] = z[k - 1] + 0.5 * dt * (v[k - 1] + v[k])
        return lift * np.interp(time / unit, t, z)


def retardation(time: np.ndarray) -> np.ndarray:
    """K(t) in units of a, g and the displaced mass, at times in units of (a / g)^1/2."""
    w = _FREQUENCIES
    number = np.concatenate([[0.0], WAVE_NUMBER])
    damping = w * np.interp(w**2, number, np.concatenate([[0.0], DAMPING]))
    return 2.0 / np.pi * np.trapezoid(damping * np.cos(w * time[:, None]), w, axis=1)


def added_mass(frequency: float) -> float:
    """What K makes of the added mass at a frequency w (a / g)^1/2 (Ogilvie 1964); the table has its
    own."""
    time = np.linspace(0.0, 60.0, 6001)
    memory = retardation(time) * np.sin(frequency * time)
    return ADDED_MASS_AT_ONCE - float(np.trapezoid(memory, time)) / frequency
