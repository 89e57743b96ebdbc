"""The spacing at which a scene's flat faces lie between rows of particles."""

from __future__ import annotations

from ..domain import Box
from ..walls import Region

_COARSER, _FINER = 0.1, 0.05  # by which a resolution may change; steps are those of the one wanted
_ROUND_OFF = 1e-6  # of a spacing


def fitted_resolution(box: Box, region: Region, side: float, resolution: int) -> int:
    """The resolution nearest to the one wanted at which walls and surfaces are in their places.

    Ghosts and particles start on one lattice, of a whole number of rows along each side of the box;
    a face halfway into a row would be misplaced by up to half a spacing, and with it the mass.

    Args:
        box: of the lattice.
        region: of fluid at the start.
        side: the length [m] that the resolution divides.
        resolution: wanted; it stays where none fits that is a tenth coarser at most, or a twentieth
            finer.
    """
    least, most = int((1.0 - _COARSER) * resolution), int((1.0 + _FINER) * resolution)
    candidates = range(max(1, least), most + 1)
    for candidate in sorted(candidates, key=lambda n: (abs(n - resolution), -n)):
        if _misfit(box, region, side / candidate) < _ROUND_OFF:
            return candidate
    return resolution


def _misfit(box: Box, region: Region, spacing: float) -> float:
    """The farthest of the region's faces within the box from the nearest border of two rows, in
    rows."""
    worst = 0.0
    for axis, place in region.flat_faces:
        along, length = place - box.lower[axis], box.lengths[axis]
        if 0.0 < along < length:
            rows = along / length * max(1, round(length / spacing))
            worst = max(worst, abs(rows - round(rows)))
    return worst
