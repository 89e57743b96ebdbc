"""How much room a region has, and how particles stand in it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from jaxtyping import Array, Float

from ..pairs import Space
from .distances import Cells
from .region import Region
from .walls import Walls

_ROW = 0.05  # times dx: so deep in the range of `WallRepulsion` that it throws particles off
_SHARE = 0.15  # of the particles beside walls: one face of a cube, not a vessel's curved wall


@lru_cache(maxsize=32)
def volume(region: Region, space: Space) -> float:
    """Volume [m^n] of a region within the box.

    Cells of the lattice are counted whole where no surface is near, and in parts by the signed
    distance elsewhere: exact where surfaces lie between cells, second-order otherwise.
    """
    return Cells.of(region, space).count * space.cell_volume


def refuse_rows_at_walls(walls: Walls, position: Float[Array, "particles dim"], space: Space):
    """A ValueError if a row of the particles starts so near to a wall that it would be thrown off.

    Single ones may be as near: a flow presses them there, and a lattice in a round vessel has some.
    """
    depth = -np.asarray(walls.signed_distance(position)) / space.spacing
    near, beside = depth < _ROW, depth < 1.0
    if near.sum() > _SHARE * beside.sum():
        worst = int(np.argmin(depth))
        raise ValueError(
            f"walls: {int(near.sum())} particles start nearer to a wall than {_ROW:g} spacings, "
            f"number {worst} at {depth[worst]:.2g}; the wall would throw them off. Let flat walls "
            "lie between the lattice's rows (end the box there); beside curved ones start from "
            "walls.put_inside(position, 0.25 * spacing)."
        )
