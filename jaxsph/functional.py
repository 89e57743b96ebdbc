"""The SPH functional f(w, t; mu): effects composed into one right-hand side."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .effects import Context, Effect
from .fluid import Fluid
from .neighbors import VerletList
from .pairs import Space, pair_sum
from .particles import ParticleState


class SPHFunctional(eqx.Module):
    """dw/dt = f(w, t; mu) for w = (position, velocity, density), the sum of the scene's effects.

    It holds the sums that its effects ask for and no others, in at most two passes over the
    pairs. Particles always move with their velocity; all else is an effect.

    Args:
        effects: in the order in which their rates are added.
        fluid: reference density, sound speed, equation of state.
        mass: of a particle [kg].
        space: box, kernel, smoothing length and spacing (static).
    """

    effects: tuple[Effect, ...]
    fluid: Fluid
    mass: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    space: Space = eqx.field(static=True)

    def __call__(
        self, time: Float[Array, ""], state: ParticleState, neighbors: VerletList
    ) -> ParticleState:
        """Rates of change of a state; state and rates in the particles' own order."""
        state = jax.tree.map(neighbors.sort, state)
        context = Context(time, self.fluid, self.mass, self.space)
        fields = {
            "position": state.position,
            "velocity": state.velocity,
            "density": state.density,
            "pressure": self.fluid.pressure(state.density),
            "volume": self.mass / state.density,
        }
        terms = tuple(t for e in self.effects for t in e.geometry_terms(self.space))
        if terms:
            with jax.named_scope("geometry_pass"):
                sums = pair_sum(terms, fields, self.space, neighbors)
            for effect in self.effects:
                with jax.named_scope(effect.name):
                    fields = fields | effect.fields(context, fields, sums)
        terms = tuple(t for e in self.effects for t in e.rate_terms(self.space))
        sums = {}
        if terms:
            with jax.named_scope("rate_pass"):
                sums = pair_sum(terms, fields, self.space, neighbors)
        rates = {
            "position": state.velocity,
            "velocity": jnp.zeros_like(state.velocity),
            "density": jnp.zeros_like(state.density),
        }
        for effect in self.effects:
            with jax.named_scope(effect.name):
                for name, rate in effect.rates(context, fields, sums).items():
                    rates[name] = rates[name] + rate
        return jax.tree.map(neighbors.unsort, ParticleState(**rates))
