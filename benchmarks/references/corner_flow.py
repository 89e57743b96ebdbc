r"""Stokes flow at a corner between a moving lid and a wall at rest: G. I. Taylor's scraper.

With X the distance to the wall, Y that to the lid, r and phi the polar coordinates of (X, Y),
a = pi / 2 and U the speed of the lid, the stream function is -U g,

    g = (a^2 Y - phi (a Y + X)) / (a^2 - 1)

(G. K. Batchelor, An Introduction to Fluid Dynamics (1967), section 4.8). It is biharmonic, with
g = 0 on both sides, g_Y = 1 on the lid and g_X = 0 on the wall. Its second derivatives are

    g_XX = Y^2 s,   g_XY = -X Y s,   g_YY = X^2 s,   s = 2 (Y - a X) / ((a^2 - 1) r^4).

At any Reynolds number it leads the flow towards the corner. A solver with smooth functions takes it
off: the vorticity of what is left stays bounded.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

RIGHT_ANGLE = np.pi / 2
SCALE = RIGHT_ANGLE**2 - 1


@dataclass(frozen=True)
class CornerFlow:
    """The flow at one end of a lid at y = 1 of the unit square.

    Arguments: the place `x` of the corner, 0 or 1, and the lid's `speed` there in m/s. Methods take
    arrays x and y of one shape, in m.
    """

    x: float
    speed: float

    def stream_function(self, x, y):
        """psi in m^2/s."""
        wall, lid, _ = self._distances(x, y)
        phi = np.arctan2(lid, wall)
        g = RIGHT_ANGLE**2 * lid - phi * (RIGHT_ANGLE * lid + wall)
        return -self.speed * g / SCALE

    def gradient(self, x, y):
        """psi_x and psi_y in m/s; the corner itself moves with the lid."""
        wall, lid, sense = self._distances(x, y)
        square = wall**2 + lid**2
        phi = np.arctan2(lid, wall)
        slope = (RIGHT_ANGLE * lid + wall) / np.where(square > 0, square, 1.0)
        g_wall = lid * slope - phi
        g_lid = RIGHT_ANGLE**2 - RIGHT_ANGLE * phi - np.where(square > 0, wall * slope, 1.0)
        return -sense * self.speed * g_wall / SCALE, self.speed * g_lid / SCALE

    def hessian(self, x, y):
        """psi_xx, psi_xy and psi_yy in 1/s; zero at the corner itself, as along its two sides."""
        wall, lid, sense = self._distances(x, y)
        square = wall**2 + lid**2
        s = 2 * (lid - RIGHT_ANGLE * wall) / (SCALE * np.where(square > 0, square, 1.0) ** 2)
        s = -self.speed * s
        return s * lid**2, sense * s * wall * lid, s * wall**2

    def pressure(self, x, y):
        """p over the dynamic viscosity, in 1/s; infinite at the corner.

        p = -2 U (a Y + X) / ((a^2 - 1) r^2) at the left end of the lid, the opposite at the right.
        """
        wall, lid, sense = self._distances(x, y)
        with np.errstate(divide="ignore", invalid="ignore"):
            shape = (RIGHT_ANGLE * lid + wall) / (wall**2 + lid**2)
        shape = np.where(np.isnan(shape), np.inf, shape)
        return -2 * sense * self.speed / SCALE * shape

    def _distances(self, x, y):
        """Distances to the wall and to the lid, and the sign of d(distance to the wall) / dx."""
        return (x, 1 - y, 1.0) if self.x == 0 else (1 - x, 1 - y, -1.0)
