"""What a scene's particles must be at its start."""

from __future__ import annotations

import numpy as np

from ..full_model import DENSITY_BOUNDS
from ..pairs import Space

_FULL = 0.75  # of its room; a lattice in a small round vessel leaves some of it
_RESOLVED = 2e-3  # of dx: a step moves a particle by some hundredths of dx


def check_one_fluid(density, reference_density: float) -> None:
    """A ValueError if densities (N,) [kg/m^3] are not those of one weakly compressible fluid."""
    ratio = np.asarray(density) / reference_density
    ratio = ratio[np.isfinite(ratio)]  # what is not finite the run names
    low, high = DENSITY_BOUNDS
    if ratio.size and (ratio.min() < low or ratio.max() > high):
        raise ValueError(
            f"density: from {reference_density * ratio.min():.6g} to "
            f"{reference_density * ratio.max():.6g} kg/m^3 at the start, beyond {low:g} to "
            f"{high:g} times the fluid's {reference_density:.6g} kg/m^3. A scene holds one fluid, "
            "so two liquids cannot be told apart; give the fluid its own reference density."
        )


def check_resolved(position, space: Space) -> None:
    """A ValueError if the precision of positions (N, n) [m] is too coarse for the spacing."""
    position = np.asarray(position)
    farthest = np.abs(position[np.isfinite(position)]).max(initial=0.0)
    unit = float(farthest * np.finfo(position.dtype).eps)
    if unit > _RESOLVED * space.spacing:
        raise ValueError(
            f"position: {position.dtype} resolves {unit:.2g} m at coordinates of {farthest:.4g} m, "
            f"too coarse for a spacing of {space.spacing:.4g} m; measure positions from an origin "
            "in the box, or use float64."
        )


def check_filled(count: int, space: Space, room: float | None) -> None:
    """A ValueError if so many particles fill only a part of the room [m^n] that has no free
    surface."""
    if room is not None and count * space.cell_volume < _FULL * room:
        raise ValueError(
            f"particles: {count} of {space.cell_volume:.4g} m^{space.box.dim} each fill "
            f"{count * space.cell_volume / room:.0%} of the room for the fluid; fill it, or list "
            "FreeSurface and what belongs to it (`scenes.dam_break`)."
        )
