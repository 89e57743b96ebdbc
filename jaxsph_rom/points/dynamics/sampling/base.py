"""What a sampling is."""

from __future__ import annotations

import abc
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ....basis import Basis


class Chosen(NamedTuple):
    """Points at which rates are evaluated, and what the modes' rates are made of there:

        da_m/dt = sum over samples p and fields f of B_mpf f_pf.

    Args:
        points: their numbers.
        gather: B.
    """

    points: Int[np.ndarray, " samples"]
    gather: Float[np.ndarray, "modes samples fields"]


class Sampling(abc.ABC):
    """A rule that chooses samples; a sample is a point with all its fields.

    Args:
        samples: how many, or the most.
    """

    samples: int

    @abc.abstractmethod
    def choose(self, basis: Basis, rates: Basis) -> Chosen:
        """Samples for the modes of a basis.

        Args:
            basis: modes Phi of the state, orthonormal in their inner product W.
            rates: of the rates on the same points, as `rate_basis` gives it.

        Raises:
            ValueError: if the bases or the points do not allow as many samples as asked for.
        """


def scaled(basis: Basis) -> Float[np.ndarray, "points fields modes"]:
    """W^(1/2) Phi: modes orthonormal in the plain product."""
    return np.asarray(basis.modes) * np.sqrt(np.asarray(basis.weights))[None, :, None]


def check(samples: int, basis: Basis, rates: Basis) -> None:
    """Raise a ValueError where samples cannot be chosen."""
    if basis.modes.shape[:2] != rates.modes.shape[:2]:
        raise ValueError(
            f"rates: on {rates.modes.shape[:2]} points and fields, the basis on "
            f"{basis.modes.shape[:2]}; take both on the same reference points."
        )
    check_count(samples, len(basis.modes))


def check_count(samples: int, points: int) -> None:
    """Raise a ValueError where there are not so many points."""
    if not 1 <= samples <= points:
        raise ValueError(f"samples: {samples} asked for, but there are 1 to {points} points.")
