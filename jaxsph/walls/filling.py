"""How much room a region has, and how particles stand in it."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from jaxtyping import Array, Float

from ..pairs import Space
from .region import Region
from .walls import Walls, distances

_PARTS = {2: 8, 3: 4}  # of a cell's side, for cells that a surface may cut
_ROW = 0.05  # times dx: so deep in the range of `WallRepulsion` that it throws particles off
_SHARE = 0.15  # of the particles beside walls: one face of a cube, not a vessel's curved wall


@lru_cache(maxsize=32)
def volume(region: Region, space: Space) -> float:
    """Volume [m^n] of a region within the box.

    Cells of the lattice are counted whole where no surface is near, and in parts by the signed
    distance elsewhere: exact where surfaces lie between cells, second-order otherwise.
    """
    cells, steps = space.lattice(), np.asarray(space.steps)
    depth = -distances(region, cells)
    whole = np.abs(depth) >= 0.5 * math.hypot(*space.steps)
    count, parts = float((depth[whole] > 0.0).sum()), _PARTS[space.box.dim]
    if not whole.all():
        offset = (np.arange(parts) + 0.5) / parts - 0.5
        offsets = np.stack(np.meshgrid(*[offset] * len(steps), indexing="ij"), axis=-1)
        offsets = offsets.reshape(-1, len(steps)) * steps
        points = (cells[~whole][:, None, :] + offsets[None]).reshape(-1, len(steps))
        filled = np.clip(0.5 - distances(region, points) * parts / steps.min(), 0.0, 1.0)
        count += float(filled.sum()) / len(offsets)
    return count * space.cell_volume


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
