"""The longest run of cells, counted one by one."""

import jax.numpy as jnp
import numpy as np


def longest_run(grid, here, there):
    """Points `there` in the cells of one row of a stencil, the most that a point `here` has."""
    seen, held = (
        np.bincount(np.asarray(grid.locate(jnp.asarray(x))), minlength=grid.cells + 1)
        for x in (here, there)
    )
    row = np.append(np.arange(grid.cells) // grid.shape[-1], -1)  # of each cell
    runs = (
        held[around[row[around] == r]].sum()
        for around in grid.stencil[seen[:-1] > 0]
        for r in set(row[around]) - {-1}
    )
    return max(runs, default=0)
