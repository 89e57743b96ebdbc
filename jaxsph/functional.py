"""The SPH functional f(w, t; mu): effects composed into one right-hand side."""

from __future__ import annotations

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .compiled import full_precision
from .effects import BodyForce, Context, Effect, parking_of
from .fluid import Fluid
from .free_motion import body_rates
from .neighbors import VerletList, WallList
from .pairs import PairTerm, Space, pair_sum
from .particles import ParticleState, in_dtype
from .wall_sums import ghost_sums, wall_sums
from .walls import Walls


class SPHFunctional(eqx.Module):
    """dw/dt = f(w, t; mu) for w = (position, velocity, density), the sum of the scene's effects.

    It holds the sums that its effects ask for and no others: two passes over the pairs at most, and
    where there are walls one over the ghosts before each. Particles always move
    with their velocity; all else is an effect.

    Args:
        effects: in the order in which their rates are added.
        fluid: reference density, sound speed, equation of state.
        mass: of a particle [kg].
        space: box, kernel, smoothing length and spacing (static).
        walls: ghost particles, if the scene has walls; where they are at one time or another.
    """

    effects: tuple[Effect, ...]
    fluid: Fluid
    mass: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    space: Space = eqx.field(static=True)
    walls: Walls | None = None

    def with_effect(self, effect: Effect) -> SPHFunctional:
        """The same with an effect in place of its one of that kind: other coefficients, say.

        Raises:
            ValueError: if it has none of that kind, or several.

        Examples:
            >>> import jaxsph
            >>> from jaxsph.effects import ConsistentViscosity
            >>> functional = jaxsph.scenes.taylor_green(16).functional()
            >>> float(functional.with_effect(ConsistentViscosity(0.5)).effects[2].viscosity)
            0.5
        """
        kinds = [type(e) for e in self.effects]
        if type(effect) not in kinds:
            names = ", ".join(e.name for e in self.effects)
            raise ValueError(f"effect: there is no {effect.name} among {names}; name one of these.")
        if kinds.count(type(effect)) > 1:
            places = [k for k, kind in enumerate(kinds) if kind is type(effect)]
            raise ValueError(
                f"effect: there are {len(places)} of the kind {effect.name}, numbers {places} of "
                "`effects`; give a new tuple by `dataclasses.replace(functional, effects=...)`."
            )
        effect = in_dtype(effect, self.mass.dtype)
        place = kinds.index(type(effect))
        return replace(self, effects=(*self.effects[:place], effect, *self.effects[place + 1 :]))

    def __call__(
        self, time: Float[Array, ""], state: ParticleState, neighbors: VerletList | WallList
    ) -> ParticleState:
        """Rates of change of a state; state and rates in the particles' own order.

        Args:
            time: [s].
            state: the particles.
            neighbors: a `WallList` where there are walls, else a `VerletList`.
        """
        return self.rates_of(self.passes(time, state, neighbors), neighbors)

    @full_precision
    def rates_of(self, passed: tuple, neighbors: VerletList | WallList) -> ParticleState:
        """The same from what `passes` found, with the rates of bodies that are free."""
        context, fields, _, _, sums = passed
        rates = self.rates(context, fields, sums, neighbors)
        if context.bodies is None or context.bodies.free is None:
            return rates
        walls = self.walls_then(context)
        with jax.named_scope("free_bodies"):
            return replace(rates, bodies=body_rates(self.effects, walls, passed, neighbors))

    @full_precision
    def rates(
        self,
        context: Context,
        fields: dict[str, Array],
        sums: dict[str, Array],
        neighbors: VerletList | WallList,
    ) -> ParticleState:
        """The particles' from the sums of the second pass."""
        rates = {
            "position": fields["velocity"],
            "velocity": jnp.zeros_like(fields["velocity"]),
            "density": jnp.zeros_like(fields["density"]),
        }
        for effect in self.effects:
            with jax.named_scope(effect.name):
                for name, rate in effect.rates(context, fields, sums).items():
                    rates[name] = rates[name] + rate
        for effect in self.effects:
            rates = effect.governed(context, fields, rates)
        for effect in self.effects:
            for name, rate in effect.transported(context, fields, sums).items():
                rates[name] = rates[name] + rate
        return jax.tree.map(neighbors.unsort, ParticleState(**rates))

    def context(
        self,
        time: Float[Array, ""],
        walls: Walls | None = None,
        pairs: VerletList | None = None,
    ) -> Context:
        """What its effects may know at a time [s], with walls and pairs of the fluid if given."""
        bodies = None if walls is None else walls.bodies
        forces = tuple(e for e in self.effects if isinstance(e, BodyForce))
        given = (time, self.fluid, self.mass, self.space, bodies, forces)
        return Context(*given, parking_of(self.effects), pairs)

    def walls_then(self, context: Context) -> Walls:
        """The walls where they are in a context of this functional."""
        free = None if context.bodies is None else context.bodies.free
        return self.walls.at(context.time, None if free is None else free.state)

    def sums(
        self, time: Float[Array, ""], state: ParticleState, neighbors: VerletList | WallList
    ) -> tuple[Context, dict[str, Array], dict[str, Array]]:
        """Context, fields and sums of the second pass, in the list's sorted order."""
        context, fields, _, _, sums = self.passes(time, state, neighbors)
        return context, fields, sums

    @full_precision
    def passes(
        self, time: Float[Array, ""], state: ParticleState, neighbors: VerletList | WallList
    ) -> tuple[Context, dict[str, Array], dict[str, Array], tuple[PairTerm, ...], dict[str, Array]]:
        """Context, fields of the particles and of the ghosts, and the second pass's terms and sums,
        in the list's sorted order."""
        bodies, state = state.bodies, replace(state, bodies=None)
        state = jax.tree.map(neighbors.sort, state)
        walls = None if self.walls is None else self.walls.at(time, bodies)
        context = self.context(time, walls, neighbors if walls is None else neighbors.fluid)
        fields = {
            "position": state.position,
            "velocity": state.velocity,
            "density": state.density,
            "pressure": self.fluid.pressure(state.density),
            "volume": self.mass / state.density,
        }
        ghosts = {} if walls is None else self._ghosts(walls, neighbors)
        gathering = () if walls is None else self.effects
        gathering = [(effect, effect.ghost_terms(context)) for effect in gathering]
        known = fields.keys() | ghosts.keys()
        first, second = [], []
        for effect, terms in gathering:
            ready = all(known.issuperset(term.reads) for term in terms)
            (first if ready else second).append((effect, terms))
        with jax.named_scope("ghost_pass"):
            ghosts = _gathered(first, context, fields, ghosts, neighbors)
        with jax.named_scope("geometry_pass"):
            terms = tuple(t for e in self.effects for t in e.geometry_terms(context))
            sums = _summed(terms, context, fields, ghosts, neighbors)
        for effect in self.effects if sums else ():
            with jax.named_scope(effect.name):
                fields = fields | effect.fields(context, fields, sums)
        with jax.named_scope("second_ghost_pass"):
            ghosts = _gathered(second, context, fields, ghosts, neighbors)
        with jax.named_scope("rate_pass"):
            terms = tuple(t for e in self.effects for t in e.rate_terms(context))
            sums = _summed(terms, context, fields, ghosts, neighbors)
        return context, fields, ghosts, terms, sums

    def _ghosts(self, walls: Walls, neighbors: WallList) -> dict[str, Array]:
        """What ghosts have of the walls, and the volume of a particle at rest."""
        order = neighbors.wall.ghosts
        ghosts = {
            "position": walls.position[order],
            "normal": walls.normal[order],
            "wall_velocity": walls.velocity[order],
            "volume": jnp.full(order.shape, self.mass / self.fluid.reference_density),
        }
        if walls.bodies is not None:
            acceleration = walls.bodies.ghost_acceleration(walls.position, walls.normal)
            ghosts["wall_acceleration"] = acceleration[order]
        return ghosts


def _summed(terms, context, fields, ghosts, neighbors) -> dict[str, Array]:
    """The sums of one pass, over particles and over ghosts."""
    own = tuple(term for term in terms if term.function is not None)
    sums = pair_sum(own, fields, context.space, context.pairs) if own else {}
    if not ghosts or not terms:
        return sums
    with jax.named_scope("walls"):
        added = wall_sums(terms, fields, ghosts, context.space, neighbors.wall)
    return added | {name: s + added[name] if name in added else s for name, s in sums.items()}


def _gathered(gathering, context, fields, ghosts, neighbors) -> dict[str, Array]:
    """Ghosts with the fields that effects make of sums over the fluid around them."""
    terms = tuple(t for _, terms in gathering for t in terms)
    sums = ghost_sums(terms, fields, ghosts, context.space, neighbors.wall) if terms else {}
    for effect, _ in gathering:
        with jax.named_scope(effect.name):
            ghosts = ghosts | effect.ghost_fields(context, ghosts, sums)
    return ghosts
