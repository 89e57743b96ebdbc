"""How many modes to keep."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from .pod import Basis, cumulative_energy


def projection_errors(singular_values: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
    """Relative error of projecting the snapshots on M = 1, 2, ... modes, in the basis' product:

        ||X - Phi_M Phi_M^* X||_F / ||X||_F = sqrt(1 - sum_{i<=M} sigma_i^2 / sum_i sigma_i^2),

    of the fluctuations X about the centre; 0 with all modes.
    """
    squared = np.asarray(singular_values, float) ** 2
    left_out = np.append(np.cumsum(squared[:0:-1])[::-1], 0.0)  # smallest first, for round-off
    return np.sqrt(left_out / (left_out[0] + squared[0]))


def modes_for_energy(basis: Basis, percent: float) -> int:
    """The least number of modes with a cumulative energy, `cumulative_energy`, of `percent`.

    Uncentred, the mean counts as energy, and one mode may have nearly all of it.

    Raises:
        ValueError: if it is not above 0 and at most 100, or takes more modes than the basis has.

    Examples:
        >>> import numpy as np
        >>> from jaxsph import Fluid
        >>> from jaxsph_rom import Energy, modes_for_energy, pod
        >>> fluid = Fluid(reference_density=1000.0, sound_speed=10.0, reference_speed=1.0)
        >>> phase = 2.0 * np.pi * (np.linspace(0.0, 1.0, 50)[:, None] - np.linspace(0.0, 1.0, 9))
        >>> wave = np.sin(phase) + 0.01 * np.sin(2.0 * phase)  # two large modes, two small ones
        >>> basis = pod(np.stack([1000.0 + wave, wave, wave], axis=1), Energy(), fluid)
        >>> basis.truncated(modes_for_energy(basis, 98.0)).size
        2
    """
    if not 0.0 < percent <= 100.0:
        raise ValueError(f"percent: {percent:g}; ask for more than 0 and at most 100.")
    energy = cumulative_energy(basis.singular_values)
    count = min(int(np.count_nonzero(energy < percent)) + 1, len(energy))
    return _within(basis, count, f"percent: {percent:g}")


def modes_for_error(basis: Basis, error: float) -> int:
    """The least number of modes that project the snapshots to a relative error at most `error`.

    It is an error in the norm of the basis' product, see `projection_errors`.

    Raises:
        ValueError: if it is not between 0 and 1, or takes more modes than the basis has.

    Examples:
        >>> import numpy as np
        >>> from jaxsph import Fluid
        >>> from jaxsph_rom import Energy, modes_for_error, pod
        >>> fluid = Fluid(reference_density=1000.0, sound_speed=10.0, reference_speed=1.0)
        >>> phase = 2.0 * np.pi * (np.linspace(0.0, 1.0, 50)[:, None] - np.linspace(0.0, 1.0, 9))
        >>> wave = np.sin(phase) + 0.01 * np.sin(2.0 * phase)  # two large modes, two small ones
        >>> basis = pod(np.stack([1000.0 + wave, wave, wave], axis=1), Energy(), fluid)
        >>> basis.truncated(modes_for_error(basis, 0.05)).size
        2
    """
    if not 0.0 <= error < 1.0:
        raise ValueError(f"error: {error:g}; ask for one from 0 to below 1.")
    count = int(np.count_nonzero(projection_errors(basis.singular_values) > error)) + 1
    return _within(basis, count, f"error: {error:g}")


def _within(basis: Basis, count: int, wanted: str) -> int:
    if count > basis.size:
        raise ValueError(
            f"{wanted} takes {count} modes, but the basis has {basis.size}; make it with more "
            "modes or ask for less."
        )
    return count
