"""The reference space: fixed points onto which snapshots of moving particles are mapped."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsph import Space, Trajectory
from jaxsph.interpolation import KernelMap, ShepardMap


def lagrangian_snapshots(trajectory: Trajectory) -> Float[np.ndarray, "particles fields times"]:
    """(rho, u) of the particles as they are numbered, density first (paper, eq. snapshots)."""
    fields = np.concatenate([trajectory.density[..., None], trajectory.velocity], axis=-1)
    return np.moveaxis(fields, 0, -1)


class ReferenceSpace(eqx.Module):
    """Reference points x_G with the composition operator G (paper, section 3.1).

    Args:
        points: (G, n) [m]; the initial or any relaxed configuration of particles.
        space: box, kernel, smoothing length of the full model.
        rule: of G: `ShepardMap` (the paper's), `MovingLeastSquaresMap`, which
            keeps linear fields, or `QuadraticMap`, which keeps quadratic ones.

    Examples:
        >>> import jaxsph
        >>> from jaxsph.arrangements import Lattice
        >>> from jaxsph_rom import ReferenceSpace
        >>> scene = jaxsph.scenes.taylor_green(16, end_time=0.06, arrangement=Lattice())
        >>> trajectory = jaxsph.run_scene(scene)
        >>> reference = ReferenceSpace(scene.state.position, scene.space)
        >>> reference.snapshots(trajectory).shape  # points, fields (density and velocity), times
        (256, 3, 4)
    """

    points: Float[Array, "points dim"]
    space: Space = eqx.field(static=True)
    map: KernelMap

    def __init__(
        self,
        points: Float[Array, "points dim"],
        space: Space,
        rule: type[KernelMap] = ShepardMap,
    ):
        self.points = jnp.asarray(points)
        self.space = space
        self.map = rule.allocate(self.points, space)

    @eqx.filter_jit  # compiled once for runs and starts
    def compose(self, position: Array, fields: Array) -> tuple[Array, Array]:
        """G: particle fields (N, F) at the reference points (G, F), and the overflow flag."""
        return self.map(position, fields)

    def snapshots(self, trajectory: Trajectory) -> Float[np.ndarray, "points fields times"]:
        """(rho, u) of all snapshots on the reference points, density first.

        Raises:
            ValueError: if particles have clumped so that a cell is overfull.
        """
        out = np.empty(
            (self.points.shape[0], 1 + self.space.box.dim, len(trajectory.time)),
            trajectory.density.dtype,
        )
        for k in range(len(trajectory.time)):
            density, velocity = trajectory.density[k][:, None], trajectory.velocity[k]
            fields, overflow = self.compose(
                trajectory.position[k], np.concatenate([density, velocity], axis=1)
            )
            if bool(overflow):
                raise ValueError(
                    f"snapshots: particles have clumped at t = {trajectory.time[k]:g} s; "
                    "the trajectory cannot be mapped."
                )
            out[:, :, k] = np.asarray(fields)
        return out
