"""Heave of a floating box by linear theory: a potential flow in a closed tank."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu

_PIN = 1e-9  # of a link between two cells: fixes the potential's level


@dataclass(frozen=True)
class Tank:
    """Small motions of water and a box that heaves in it, without friction:

        laplace(phi) = 0,    kinetic energy T = 1/2 q'^T M q',    potential energy 1/2 q^T K q,

    with q the heights of the free surface's cells and of the box, in finite volumes of second
    order. M is made of the potential phi that each q' drives through its part of the boundary,
    where all other walls let nothing pass, and of the box's mass; q keeps the water's volume.

    Args:
        length, level: of the tank and of the water at rest [m].
        width, draught: of the box in its middle [m].
        mass: of the box [kg], of a metre's depth.
        density: of the water [kg/m^3].
        gravity: [m/s^2].
        cells: along the tank; its half width and the box's must be whole numbers of them.
    """

    length: float
    level: float
    width: float
    draught: float
    mass: float
    density: float
    gravity: float
    cells: int

    @cached_property
    def modes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Frequencies [rad/s], heave in each mode, M, and all modes in terms of the coordinates."""
        dx = self.length / self.cells
        rows = round(self.level / dx)
        dy = self.level / rows
        wide, deep = round(self.width / dx), max(1, round(self.draught / dy))
        left = (self.cells - wide) // 2
        wet = np.ones((self.cells, rows), bool)
        wet[left : left + wide, rows - deep :] = False
        number = np.full(wet.shape, -1)
        number[wet] = np.arange(wet.sum())
        links = coo_matrix((len(number[wet]),) * 2).tolil()
        for a, b, weight in (
            (number[:-1], number[1:], dy / dx),
            (number[:, :-1], number[:, 1:], dx / dy),
        ):
            both = (a >= 0) & (b >= 0)
            i, j, w = a[both], b[both], np.full(both.sum(), weight)
            places = (np.concatenate([i, j, i, j]), np.concatenate([j, i, i, j]))
            links = links + coo_matrix((np.concatenate([-w, -w, w, w]), places), links.shape)
        surface = np.flatnonzero(wet[:, -1])
        flux = np.zeros((links.shape[0], len(surface) + 1))
        flux[number[surface, -1], np.arange(len(surface))] = dx
        flux[number[left : left + wide, rows - deep - 1], -1] = dx
        sides = np.append(np.full(len(surface), dx), wide * dx)
        keeping = np.linalg.svd(sides[None])[2][1:].T  # coordinates that keep the volume
        pin = coo_matrix(([_PIN], ([0], [0])), links.shape)
        potential = splu((links + pin).tocsc()).solve(flux @ keeping)
        inertia = (flux @ keeping).T @ potential
        # from a cell's middle to its face
        inertia += keeping.T @ np.diag(0.5 * dy * sides) @ keeping
        inertia *= self.density
        inertia += self.mass * np.outer(keeping[-1], keeping[-1])
        stiffness = self.density * self.gravity * keeping.T @ np.diag(sides) @ keeping
        squares, modes = eigh(stiffness, 0.5 * (inertia + inertia.T))
        return np.sqrt(squares), keeping[-1] @ modes, modes.T @ inertia @ keeping.T, sides

    def heave(self, time: np.ndarray, lift: float) -> np.ndarray:
        """Of the box [m] over time [s], let go from rest at a height [m] above its place, with the
        water level as its volume wants it."""
        frequency, share, taken, sides = self.modes
        start = np.full(len(sides), -lift * sides[-1] / sides[:-1].sum())
        start[-1] = lift
        amplitude = share * (taken @ start)
        return (amplitude * np.cos(np.outer(time, frequency))).sum(axis=1)
