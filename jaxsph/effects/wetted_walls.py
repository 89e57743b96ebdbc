"""Walls that hold nothing above the water line."""

import jax.numpy as jnp

from ..ramps import ramp
from .base import Effect

_WET = (-0.5, 0.5)  # spacings under the water line


class WettedWalls(Effect):
    """Ghosts above the water line are dry: of a ghost's pressure p_g, as `WallPressure` has it,

        V_g <- w V_g,    p_g <- max(p_g, 0),    w a ramp from 0 to 1 of p_g / (rho0 |b| dx)

    from -1/2 to 1/2, b the body forces' sum at the ghost. WallPressure goes on hydrostatically
    from the fluid to the ghost, so that p_g is zero where the water line meets the wall. Full
    ghosts beside a dry wall make a surface particle of its corner one of the inside: it is drawn
    to the wall and sinks along it, and the column beside the wall is pressed together. Stands
    behind `WallPressure`; without body forces it does nothing.
    """

    def ghost_fields(self, context, ghosts, sums):
        if "pressure" not in ghosts:
            raise ValueError(
                "effects: WettedWalls needs WallPressure before it; list it there."
            )
        if not context.forces:
            return {}
        position = ghosts["position"]
        total = sum(force.acceleration(context.time, position) for force in context.forces)
        strength = jnp.sqrt(jnp.sum(total**2, axis=1))
        head = context.fluid.reference_density * strength * context.space.spacing
        pressed = ghosts["pressure"] / jnp.where(head > 0.0, head, 1.0)
        wet = jnp.where(head > 0.0, ramp(pressed, *_WET), 1.0)
        pressure = jnp.maximum(ghosts["pressure"], 0.0)
        density = context.fluid.density(pressure)
        return {
            "pressure": pressure,
            "density": density,
            "volume": wet * context.mass / density,
        }
