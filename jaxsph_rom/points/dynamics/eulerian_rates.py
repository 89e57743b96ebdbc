"""The fluid's equations at fixed points as they stand, on all points or on some of them."""

from __future__ import annotations

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxsph import ParticleState, SPHFunctional, VerletList, WallList
from jaxsph.cloud import Cloud
from jaxsph.scenes import Scene

from ...field_advection import FieldAdvection
from .coefficients import Coefficients
from .fixed_points import on_points, with_effects
from .log_density import from_log_density
from .point_lists import neighbors_at


class EulerianRates(eqx.Module):
    """f-bar(w, t; theta) of w = (r, u) at fixed points x_G, r the logarithmic density:

        du/dt = f_u - u . grad u,    dr/dt = (rho0 / rho) (f_rho - u . grad rho),

    with f the SPH functional, time and particle volumes m / rho included. Nothing is linearised:
    any equation of state, any force, walls as the full model has them, and a fringe governs f_u.

    Args:
        functional: effects that act on fixed points, and `FieldAdvection`.
        points: x_G (G, n) [m].
        neighbors: list of the points; none where rates are only taken `around` some of them.
        coefficients: what of the functional is left open: theta (K,).
    """

    functional: SPHFunctional
    points: Float[Array, "points dim"]
    neighbors: VerletList | WallList | None
    coefficients: Coefficients

    @classmethod
    def of_scene(
        cls,
        scene: Scene,
        points: Float[Array, "points dim"],
        coefficients: Coefficients | None = None,
    ) -> EulerianRates:
        """Rates of a scene.

        Args:
            scene: whose effects and walls act.
            points: x_G (G, n) [m].
            coefficients: left open; the scene's viscosity if none are given.

        Raises:
            ValueError: if the box is too small for the kernel's support, bodies are moved through
                the fluid, or an effect has no meaning on fixed points.
        """
        functional = on_points(scene)
        if coefficients is None:
            coefficients = Coefficients.named(functional, "viscosity")
        return cls.of(functional, points, coefficients)

    @classmethod
    def of(
        cls,
        functional: SPHFunctional,
        points: Float[Array, "points dim"],
        coefficients: Coefficients,
        listed: bool = True,
    ) -> EulerianRates:
        """Rates by a functional of fixed points (`on_points`), with a list of these or without."""
        functional = with_effects(functional, (*functional.effects, FieldAdvection()))
        if listed:
            return cls._of(functional, points, coefficients)
        return cls(functional, jnp.asarray(points, functional.mass.dtype), None, coefficients)

    @classmethod
    def _of(cls, functional: SPHFunctional, points, coefficients) -> EulerianRates:
        points = jnp.asarray(points, functional.mass.dtype)
        return cls(functional, points, neighbors_at(functional, points), coefficients)

    def __call__(
        self,
        time: Float[Array, ""],
        fields: Float[Array, "points fields"],
        values: Float[Array, " coefficients"],
    ) -> Float[Array, "points fields"]:
        """Rates of (r, u)."""
        functional = self.coefficients.applied(self.functional, values)
        fluid = functional.fluid
        density = from_log_density(fields[:, 0], fluid)
        state = ParticleState(self.points, fields[:, 1:], density)
        found = functional(time, state, self.neighbors)
        log_rate = fluid.reference_density / density * found.density
        return jnp.concatenate([log_rate[:, None], found.velocity], axis=1)

    def around(
        self, samples: Sequence[int] | Int[np.ndarray, " samples"]
    ) -> tuple[EulerianRates, Int[np.ndarray, " members"]]:
        """The same rates on the points and ghosts that those at the samples depend on.

        The second pass reads at a sample's neighbours what the first pass made of theirs, and a
        ghost takes its values from the fluid around it: so rates at the samples are exact, while
        those at the other members, which stand at the rim, are not.

        Args:
            samples: numbers of points, each once.

        Returns:
            the rates, and the numbers of their points, the samples first.

        Raises:
            ValueError: if a sample is not a point or stands twice.
        """
        samples = np.asarray(samples, int)
        count = len(self.points)
        if not len(samples) or len(np.unique(samples)) < len(samples):
            raise ValueError("samples: give at least one point, and each once.")
        if samples.min() < 0 or samples.max() >= count:
            raise ValueError(f"samples: numbers from 0 to {count - 1}, got {samples.max()}.")
        functional, coefficients = self.functional, self.coefficients
        space, walls = functional.space, functional.walls
        reach = space.support * (1.0 + 1e-9)
        points = Cloud(np.asarray(self.points), space.box)
        near = points.around(points.positions[samples], reach)
        context = functional.context(jnp.zeros(()))
        first_pass = [term for e in functional.effects for term in e.geometry_terms(context)]
        members = points.around(points.positions[near], reach) if first_pass else near
        if walls is not None:
            ghosts = Cloud(np.asarray(walls.position), space.box)
            at_walls = any(term.ghost is not None for term in first_pass)
            seeing = near if at_walls else samples
            seen = ghosts.around(points.positions[seeing], reach)
            members = np.union1d(members, points.around(ghosts.positions[seen], reach))
            kept = jax.tree.map(lambda a: jnp.asarray(np.asarray(a)[seen]), walls)
            walls = kept if len(seen) else None
            functional = eqx.tree_at(lambda f: f.walls, functional, walls)
            coefficients = coefficients.at_ghosts(seen)
        members = np.concatenate([samples, np.setdiff1d(members, samples)])
        return self._of(functional, points.positions[members], coefficients), members
