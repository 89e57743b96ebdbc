"""What an interpolation of modes is: known at fixed points, wanted at moving particles."""

from __future__ import annotations

import abc
from typing import Self

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxsph import Box, Space


class ModeInterpolation(eqx.Module):
    """Functions on reference points, carried to particles; exact at the points."""

    @classmethod
    @abc.abstractmethod
    def check(cls, points: Float[np.ndarray, "points dim"], space: Space, order: int) -> None:
        """Raise a ValueError if it cannot be fitted to these points, before anything is run."""

    @classmethod
    @abc.abstractmethod
    def fit(
        cls,
        points: Float[np.ndarray, "points dim"],
        values: Float[np.ndarray, "points functions"],
        space: Space,
        order: int = 3,
    ) -> Self:
        """Prepare the interpolation once, on the host.

        Args:
            points: reference points [m].
            values: of the functions at the points.
            space: box, kernel and spacing of the full model.
            order: of the splines or polynomials.

        Raises:
            ValueError: as `check`.
        """

    @property
    @abc.abstractmethod
    def box(self) -> Box:
        """Where the particles are."""

    @property
    @abc.abstractmethod
    def functions(self) -> int:
        """How many there are."""

    @abc.abstractmethod
    def combined(self, matrix: Float[Array, "functions sums"]) -> Self:
        """Of sums of the functions; nothing is solved again."""

    @abc.abstractmethod
    def select(self, functions) -> Self:
        """Of some of the functions, by number; nothing is solved again."""

    @abc.abstractmethod
    def overflow(self, position: Float[Array, "particles dim"]) -> Bool[Array, ""]:
        """Whether particles crowd so that there is no room for them."""

    @abc.abstractmethod
    def __call__(
        self, position: Float[Array, "particles dim"]
    ) -> Float[Array, "particles functions"]:
        """The functions at particles; meaningless if `overflow` is true."""

    def slope_along(
        self,
        position: Float[Array, "particles dim"],
        direction: Float[Array, "particles dim"],
    ) -> Float[Array, "particles functions"]:
        """direction . grad phi at particles."""
        return jax.jvp(self, (position,), (direction,))[1]
