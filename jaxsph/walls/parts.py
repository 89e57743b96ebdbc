"""Named parts of the walls, whose forces are told apart."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from .region import Region

WHOLE = "walls"  # the name of all of them together
_TAKEN = (WHOLE, "time")  # names that files have for something else


@final
@dataclass(frozen=True)
class WallPart:
    """A part of the walls, or a moving body, whose force and torque are recorded by a name.

    Its coefficients are C = 2 F / (rho0 U^2 L^(n - 1)) of the mean force.

    Args:
        name: of the part.
        region: that holds its ghosts at t = 0, on its surface or in it; one on the surfaces of
            several parts belongs to the first of them.
        reference_length: L [m]; the longest side of a box around its ghosts if none is given.
        reference_speed: U [m/s]; the fluid's if none is given.

    Raises:
        ValueError: for a name that cannot be one, or a length or speed that is not positive.

    Examples:
        >>> from jaxsph import BallRegion, WallPart
        >>> WallPart("cylinder", BallRegion((0.2, 0.2), 0.05), reference_length=0.1).name
        'cylinder'
    """

    name: str
    region: Region
    reference_length: float | None = None
    reference_speed: float | None = None

    def __post_init__(self):
        if not self.name or "/" in self.name or self.name in _TAKEN:
            raise ValueError(
                f"part: the name {self.name!r} cannot be used; take a word without a slash, other "
                f"than {' and '.join(_TAKEN)}."
            )
        for name in ("reference_length", "reference_speed"):
            value = getattr(self, name)
            if value is not None and not value > 0.0:
                raise ValueError(f"part {self.name}: {name} must be positive, got {value:g}.")
