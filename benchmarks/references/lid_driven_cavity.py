r"""Steady incompressible flow in the unit square under a moving lid, by a Galerkin method.

An independent reference for particle runs: numpy and scipy only, nothing of jaxsph. The side is
1 m, the density 1 kg/m^3, the viscosity 1 / Re m^2/s. With a stream function psi the velocity
(u, v) = (psi_y, -psi_x) is divergence-free, and the steady Navier-Stokes equations lose their
pressure when tested with a velocity (chi_y, -chi_x) that vanishes on the boundary:

    integral of Laplace psi (Laplace chi + Re (psi_y chi_x - psi_x chi_y)) = 0,

    psi = psi_n = 0 on the walls,   psi = 0 and psi_y = U(x) on the lid y = 1.

psi is a polynomial in x and y plus, where the lid's speed jumps at a corner, the corner's Stokes
flow, without which the jump would spoil the interior too (O. Botella and R. Peyret, Computers &
Fluids 27 (1998) 421-433). Newton's method climbs in Reynolds number from Stokes flow.

Largest change of velocity between resolutions on a 41 x 41 grid, and where 0.1 <= x, y <= 0.9:

    lid          Re      24 to 32            32 to 40            40 to 48
    regularised   100    8.0e-5   1.5e-5    1.2e-5   5.6e-7    1.9e-6   8.9e-8
    regularised   400    5.3e-4   4.4e-4    2.6e-5   2.2e-5    2.8e-6   1.0e-6
    regularised  1000    2.3e-3   1.6e-3    4.3e-4   2.1e-4    5.3e-5   3.6e-5
    constant      100    1.3e-3   1.2e-4    3.7e-4   1.7e-5    6.8e-5   6.2e-6
    constant      400    4.8e-3   9.9e-4    2.1e-3   1.2e-4    3.6e-4   2.9e-5
    constant     1000    1.4e-2   2.5e-3    6.8e-3   6.0e-4    1.3e-3   9.0e-5
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev, legendre
from scipy.linalg import eigh
from scipy.linalg import solve as solve_dense

from benchmarks.references.corner_flow import CornerFlow

CLIMBING_RESOLUTION = 24  # coarse: the climb costs less than the last solve
CLIMBING_FACTOR = 2.0  # between two Reynolds numbers of the climb
CLIMBING_START = 100.0  # reached from Stokes flow in one go
NEWTON_STEPS = 20
# Bounds on the last change in psi over the lid's speed. Convergence is quadratic, so that the error
# left is far smaller.
CLIMBING_TOLERANCE = 1e-3
NEWTON_TOLERANCE = 1e-8
OUTSIDE = 1e-9  # by which points may miss the square, for rounding
ENDS = np.array([0.0, 1.0])

Lid = Callable[[np.ndarray], np.ndarray]


def regularised_lid(x: np.ndarray) -> np.ndarray:
    """Lid speed `U(x) = (1 - (2x - 1)^14)^2`, at rest with zero slope at both ends."""
    return (1 - (2 * np.asarray(x, dtype=float) - 1) ** 14) ** 2


def constant_lid(x: np.ndarray) -> np.ndarray:
    """Lid speed `U(x) = 1`, which jumps at both ends."""
    return np.ones_like(np.asarray(x, dtype=float))


LIDS = {"constant": constant_lid, "regularised": regularised_lid}
PROBE_RADIUS = 3.0  # times dx: about a point where a run is compared with these


@dataclass(frozen=True)
class CavityFlow:
    """A steady flow in the unit square, made by `solve`, to evaluate at any points (P, 2) in it.

    psi = sum of `stream[i, j] T_i(2x - 1) T_j(2y - 1)` and of the corner flows; the pressure is a
    like sum of Legendre polynomials and of the corner flows' pressures.
    """

    reynolds: float
    resolution: int
    corners: tuple[CornerFlow, ...]
    stream: np.ndarray
    legendre_pressure: np.ndarray

    def stream_function(self, points: np.ndarray) -> np.ndarray:
        """psi, (P,), in m^2/s: zero on the boundary, negative in a clockwise vortex."""
        x, y = _inside(points)
        return _series(self.stream, x, y) + sum(c.stream_function(x, y) for c in self.corners)

    def velocity(self, points: np.ndarray) -> np.ndarray:
        """(u, v) = (psi_y, -psi_x), (P, 2), in m/s."""
        x, y = _inside(points)
        slopes = np.array([_series(self.stream, x, y, 1, 0), _series(self.stream, x, y, 0, 1)])
        for corner in self.corners:
            slopes += corner.gradient(x, y)
        return np.stack([slopes[1], -slopes[0]], axis=-1)

    def pressure(self, points: np.ndarray) -> np.ndarray:
        """p, (P,), in Pa, with zero mean over the square; infinite where the lid's speed jumps."""
        x, y = _inside(points)
        degree = len(self.legendre_pressure) - 1
        left, right = (legendre.legvander(2 * s - 1, degree) for s in (x, y))
        series = np.sum((left @ self.legendre_pressure) * right, axis=-1)
        return series + sum(c.pressure(x, y) for c in self.corners) / self.reynolds


def solve(reynolds: float, lid: Lid, resolution: int = 48) -> CavityFlow:
    """The steady flow under a lid of speed `lid(x)` in m/s, at viscosity `1 / reynolds` m^2/s.

    Arguments: `lid` takes and returns an array (N,) over 0 <= x <= 1. Its slope should vanish at
    both ends: that of `sin(pi x)` costs 2 % of the speed on the lid itself at resolution 40, and
    3e-5 where 0.1 <= x, y <= 0.9. `resolution` N gives polynomials of degree N + 2 along a side;
    time grows as its sixth power, memory as its fourth (230 MB at 48).

    Raises `ValueError` for arguments out of range, and if Newton's method does not converge.
    """
    if not (np.isfinite(reynolds) and reynolds > 0):
        raise ValueError(f"reynolds must be positive and finite, got {reynolds}")
    if not (float(resolution).is_integer() and resolution >= 8):
        raise ValueError(f"resolution must be an integer of at least 8, got {resolution}")
    samples = np.linspace(0, 1, 101)
    speeds = np.asarray(lid(samples))
    if speeds.shape != samples.shape or not np.all(np.isfinite(speeds)):
        raise ValueError(f"lid must return finite speeds (101,) for x (101,), got {speeds.shape}")
    fastest = float(np.max(np.abs(speeds)))
    corners = tuple(
        CornerFlow(float(x), float(speed))
        for x, speed in zip(ENDS, lid(ENDS), strict=True)
        if speed != 0
    )
    climb = [float(reynolds)]
    while climb[0] * fastest > CLIMBING_START:
        climb.insert(0, climb[0] / CLIMBING_FACTOR)
    stream, coarse = np.zeros((1, 1)), min(int(resolution), CLIMBING_RESOLUTION)
    space = _Space(coarse, lid, corners)
    for step in (0.0, *climb):
        stream = _newton(space, step, stream, CLIMBING_TOLERANCE * fastest)
    if resolution > coarse:
        space = _Space(int(resolution), lid, corners)
    stream = _newton(space, climb[-1], stream, NEWTON_TOLERANCE * fastest)
    pressure = _pressure(climb[-1], stream, corners)
    return CavityFlow(climb[-1], int(resolution), corners, stream, pressure)


class _Space:
    """Polynomials of degree N + 2 in x and in y that fulfil the boundary conditions.

    Along a side a polynomial has as its "data" its values at the N + 1 Chebyshev points and its
    slopes at both ends. All data of psi but the (N - 1)^2 interior values are known.
    """

    def __init__(self, resolution, lid, corners):
        degree = resolution + 2
        self.corners = corners
        self.points = (1 - np.cos(np.pi * np.arange(resolution + 1) / resolution)) / 2
        self.inner = slice(1, resolution)
        self.to_coefficients = np.linalg.inv(
            np.concatenate([_basis(self.points, degree), _basis(ENDS, degree, 1)])
        )
        self.boundary = self._boundary(lid)
        nodes, weights = legendre.leggauss(3 * degree // 2 + 1)  # exact for the cubic terms
        nodes, weights = (1 + nodes) / 2, weights / 2
        self.mesh = np.meshgrid(nodes, nodes, indexing="ij")
        self.weights = weights[:, None] * weights
        # Derivatives of order 0, 1, 2 at the nodes from data, and those of the test functions.
        self.at_nodes = [_basis(nodes, degree, k) @ self.to_coefficients for k in range(3)]
        self.tests = [matrix[:, self.inner] for matrix in self.at_nodes]
        laplacian = ((2, 0), (0, 2))
        self.viscous = self.matrix([(1.0, test, of) for test in laplacian for of in laplacian])

    def _boundary(self, lid):
        """Data, (N + 3, N + 3), with zero interior values; the slopes at 0 and 1 come last."""
        last = len(self.points) - 1
        data = np.zeros((last + 3, last + 3))
        data[: last + 1, last + 2] = lid(self.points)
        for corner in self.corners:
            for end, value, slope in ((0.0, 0, last + 1), (1.0, last, last + 2)):
                side = np.full_like(self.points, end)
                data[value, : last + 1] -= corner.stream_function(side, self.points)
                data[slope, : last + 1] -= corner.gradient(side, self.points)[0]
                data[1:last, value] -= corner.stream_function(self.points, side)[1:-1]
                data[: last + 1, slope] -= corner.gradient(self.points, side)[1]
                data[slope, last + 1 :] -= corner.hessian(np.full(2, end), ENDS)[1]
        return data

    def derivative(self, data, i, j):
        """The derivative of orders (i, j) in x and y at the quadrature nodes."""
        return self.at_nodes[i] @ data @ self.at_nodes[j].T

    def vector(self, field, orders):
        """Integrals of a field times the derivatives of all test functions, (N - 1, N - 1)."""
        i, j = orders
        return self.tests[i].T @ (self.weights * field) @ self.tests[j]

    def matrix(self, terms):
        """Integrals of a field times a derivative of all tests times one of all trial functions.

        Summed over terms (field, orders for the test function, orders for the trial function). Done
        one direction after the other, for about N^5 products rather than N^6.
        """
        count = self.inner.stop - 1
        along_y = {}
        for field, (i, j), (k, m) in terms:
            part = (self.weights * field) @ self._products(j, m)
            along_y[i, k] = along_y.get((i, k), 0.0) + part
        total = sum(self._products(i, k).T @ part for (i, k), part in along_y.items())
        total = total.reshape(count, count, count, count).swapaxes(1, 2)
        return total.reshape(count**2, count**2)

    def _products(self, i, k):
        products = self.tests[i][:, :, None] * self.tests[k][:, None, :]
        return products.reshape(len(products), -1)


def _newton(space, reynolds, start, tolerance):
    """Chebyshev coefficients of the polynomial part of psi, from those of any degree to start."""
    data = space.boundary.copy()
    basis = _basis(space.points[space.inner], len(start) - 1)
    data[space.inner, space.inner] = basis @ start @ basis.T
    for _ in range(NEWTON_STEPS):
        residual, jacobian = _linearise(space, reynolds, data)
        change = solve_dense(jacobian, -residual.ravel(), overwrite_a=True, check_finite=False)
        data[space.inner, space.inner] += change.reshape(residual.shape)
        if np.max(np.abs(change)) <= tolerance:
            return space.to_coefficients @ data @ space.to_coefficients.T
    raise ValueError(
        f"no steady flow found at reynolds {reynolds:g} in {NEWTON_STEPS} Newton steps at "
        f"resolution {space.inner.stop}; lower reynolds or raise CLIMBING_RESOLUTION"
    )


def _linearise(space, reynolds, data):
    """The weak form's residual, (N - 1, N - 1), and its derivative by the interior values."""
    slope_x, slope_y = space.derivative(data, 1, 0), space.derivative(data, 0, 1)
    laplacian = space.derivative(data, 2, 0) + space.derivative(data, 0, 2)
    # The corner flows are biharmonic: they add nothing to the viscous term.
    residual = space.vector(laplacian, (2, 0)) + space.vector(laplacian, (0, 2))
    for corner in space.corners:
        corner_x, corner_y = corner.gradient(*space.mesh)
        slope_x, slope_y = slope_x + corner_x, slope_y + corner_y
        corner_xx, _, corner_yy = corner.hessian(*space.mesh)
        laplacian = laplacian + corner_xx + corner_yy
    with_x, with_y = reynolds * slope_y, -reynolds * slope_x
    residual += space.vector(laplacian * with_x, (1, 0)) + space.vector(laplacian * with_y, (0, 1))
    jacobian = space.viscous + space.matrix(
        [
            (with_x, (1, 0), (2, 0)),
            (with_x, (1, 0), (0, 2)),
            (with_y, (0, 1), (2, 0)),
            (with_y, (0, 1), (0, 2)),
            (reynolds * laplacian, (1, 0), (0, 1)),
            (-reynolds * laplacian, (0, 1), (1, 0)),
        ]
    )
    return residual, jacobian


def _pressure(reynolds, stream, corners):
    """Legendre coefficients, (degree + 1, degree + 1), of p less that of the corner flows.

    They minimise the integral of |grad p - f|^2, f = Laplace u / Re - u . grad u: the weak form of
    the pressure Poisson equation, with the momentum equation's normal part on the boundary.
    """
    degree = len(stream) - 1
    nodes, weights = legendre.leggauss(2 * degree)
    nodes, weights = (1 + nodes) / 2, weights / 2
    mesh = np.meshgrid(nodes, nodes, indexing="ij")
    by_order = [_basis(nodes, degree, order) for order in range(4)]

    def at(i, j):
        return by_order[i] @ stream @ by_order[j].T

    slopes = np.array([at(1, 0), at(0, 1)])
    seconds = np.array([at(2, 0), at(1, 1), at(0, 2)])
    for corner in corners:
        slopes += corner.gradient(*mesh)
        seconds += corner.hessian(*mesh)
    (x, y), (xx, xy, yy) = slopes, seconds
    # A corner flow's viscous force is the gradient of its own pressure, so it is left out.
    force_x = (at(2, 1) + at(0, 3)) / reynolds - (y * xy - x * yy)
    force_y = -(at(3, 0) + at(1, 2)) / reynolds + (y * xx - x * xy)

    value = legendre.legvander(2 * nodes - 1, degree)
    slope = value[:, :-1] @ legendre.legder(np.eye(degree + 1), scl=2)
    test, test_slope = value.T * weights, slope.T * weights
    right = test_slope @ force_x @ test.T + test @ force_y @ test_slope.T
    # The modes of one direction turn the two-dimensional matrix into a diagonal one.
    stiffness, modes = eigh(test_slope @ slope, test @ value)
    divisor = stiffness[:, None] + stiffness[None, :]
    divisor[0, 0] = np.inf  # the constant, which no gradient sees
    pressure = modes @ (modes.T @ right @ modes / divisor) @ modes.T
    pressure[0, 0] = -sum(weights @ c.pressure(*mesh) @ weights for c in corners) / reynolds
    return pressure


def _basis(points, degree, order=0):
    """Derivatives in x of T_0 ... T_degree of 2x - 1, (points, degree + 1)."""
    lowered = chebyshev.chebder(np.eye(degree + 1), order, scl=2)
    return chebyshev.chebvander(2 * points - 1, degree - order) @ lowered


def _series(coefficients, x, y, order_x=0, order_y=0):
    degree = len(coefficients) - 1
    left, right = _basis(x, degree, order_x), _basis(y, degree, order_y)
    return np.sum((left @ coefficients) * right, axis=-1)


def _inside(points):
    points = np.asarray(points, dtype=float)
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"points must have shape (P, 2), got {points.shape}")
    if not np.all((points >= -OUTSIDE) & (points <= 1 + OUTSIDE)):
        raise ValueError("points must lie in the unit square, got some outside; leave them out")
    return np.clip(points, 0, 1).T
