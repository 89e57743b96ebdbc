"""A short-range repulsion by walls, for particles that flow around an edge."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..walls.distances import distances
from ..walls.region import Region
from .base import Effect

_RANGE = 0.15  # times dx; a particle at rest beside a wall is half a spacing away
_ASIDE = 1e-3  # times dx
_RUNGE_KUTTA = 2.8284  # of the frequency of an oscillator: the step that RK4 stands
_STRENGTH = 0.2  # holds a particle that flies at the wall with up to c0 sqrt(strength range / 1.5)


class WallRepulsion(Effect):
    """du_i/dt = A c0^2 / dx (1 - d_i / a)^2 n_i where d_i < a, and nothing farther from walls:

    d_i is the particle's distance to the wall, n_i the wall's normal, a = 0.15 dx, A = 0.2.
    Pressure alone keeps particles half a spacing away from flat walls; where a flow turns sharply
    around an edge, some would cut the corner. The force has a potential, so it holds every particle
    whose speed towards the wall is below c0 (2 A a / (3 dx))^(1/2), 0.14 c0. Short-range boundary
    forces go back to Monaghan (1994). A particle held at d oscillates at
    w = c0 (2 A (1 - d / a) / (a dx))^(1/2), which a step resolves up to 2.83 / w (RK4): 2.1 dx / c0
    at d = 0.05 dx, which limits the step of a scene that starts with particles so near.

    Args:
        fluid_region: where fluid may be (static); the scene's moving bodies repel as well.
    """

    fluid_region: Region = eqx.field(static=True)

    def step_limit_from(self, position, fluid, space):
        """That of an oscillator of the force's stiffness where the nearest particle starts."""
        inside = -distances(self.fluid_region, np.asarray(position)) / space.spacing
        nearest = float(np.min(inside, where=inside > 0.0, initial=np.inf))
        closeness = max(1.0 - nearest / _RANGE, 0.0)
        stiffness = 2.0 * _STRENGTH * closeness / _RANGE
        if stiffness == 0.0:
            return math.inf
        return _RUNGE_KUTTA / stiffness**0.5 * space.spacing / float(fluid.sound_speed)

    def on_fixed_points(self):
        return ()  # no point comes near a wall

    def rates(self, context, fields, sums):
        distance, spacing = self._distance(context.bodies), context.space.spacing
        position, reach = fields["position"], _RANGE * spacing
        # a distance has no slope in the middle of a vessel, where a lattice may have a particle
        far = distance(lax.stop_gradient(position)) <= -reach
        position = position + jnp.where(far, _ASIDE * spacing, 0.0)[:, None]
        closeness = jnp.where(far, 0.0, jnp.maximum(1.0 + distance(position) / reach, 0.0))
        outward = jax.vmap(jax.grad(lambda x: distance(x[None, :])[0]))(position)
        strength = _STRENGTH * context.fluid.sound_speed**2 / spacing
        return {"velocity": -(strength * closeness**2)[:, None] * outward}

    def on_walls(self, context, fields, surface):
        return surface.held_off(context.mass * self.rates(context, fields, {})["velocity"])

    def _distance(self, bodies):
        """Positions -> distances to the nearest wall."""
        fixed = self.fluid_region.signed_distance
        if bodies is None:
            return fixed
        return lambda x: jnp.maximum(fixed(x), -bodies.signed_distance(x))
