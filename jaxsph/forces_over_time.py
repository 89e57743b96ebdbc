"""What a fluid does to its walls, added up as a run goes."""

from __future__ import annotations

import dataclasses
from typing import final

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from .full_model import FullModel
from .integrate import Model
from .particles import ParticleState
from .trajectory import Snapshot
from .wall_forces import WallForces, loads_of
from .wall_surface import Loads


class WithImpulse(eqx.Module):
    """Particles, and what they have done to the walls since the start.

    Args:
        particles: as they are.
        impulse: on each of K parts of the walls, J (K, n) [N s] and its moment [N m s].
    """

    particles: ParticleState
    impulse: Loads

    def means(
        self, names: tuple[str, ...], seconds: Float[Array, ""]
    ) -> tuple[dict[str, Array], dict[str, Array]]:
        """Mean forces [N] and torques [N m] by the parts' names."""
        means = (each / seconds for each in self.impulse)
        return tuple(dict(zip(names, each, strict=True)) for each in means)


@final
class ForcesOverTime(Model):
    """A full model beside the impulse of its fluid on the walls,

        dw/dt = f(w, t),    dJ/dt = F(w, t),

    F of `WallForces`. One and the same method steps both, so J is as exact as the particles'
    way; and as it keeps what is linear in the rates, impulse on all walls, that of the weight and
    the change of momentum add up to zero to round-off, step by step. The sums over pairs are those
    of f. A force that scatters from instant to instant, as lift does on disordered particles, is
    known by its mean J / t.

    Args:
        model: of the particles.
        forces: of its scene.

    Examples:
        >>> import jax.numpy as jnp
        >>> import jaxsph
        >>> from jaxsph.integrate import integrate
        >>> tank = jaxsph.scenes.hydrostatic_tank(16)
        >>> model = jaxsph.ForcesOverTime(tank.model(), jaxsph.WallForces.of(tank))
        >>> dt = jnp.asarray(tank.time_step)
        >>> end, *_ = integrate(model, model.start(tank.state), jnp.asarray(0), dt, 4, 1)
        >>> forces, _ = end.means(model.forces.names, 4 * dt)
        >>> round(float(forces["walls"][1]), -1)  # N/m: the weight of a ton of water at g = 1
        -1000.0
    """

    model: FullModel
    forces: WallForces

    def start(self, particles: ParticleState) -> WithImpulse:
        """Particles that have done nothing yet."""
        held, dim = self.forces.held.shape[0], particles.position.shape[1]
        zero = jnp.zeros((held, dim), particles.position.dtype)
        return WithImpulse(particles, Loads(zero, zero[:, 0] if dim == 2 else zero))

    def rates(self, time, state, auxiliary):
        functional = self.model.functional
        passed = functional.passes(time, state.particles, auxiliary)
        rates = functional.rates_of(passed, auxiliary)
        return WithImpulse(rates, loads_of(self.forces, functional, passed, auxiliary))

    def over(self, devices):
        return dataclasses.replace(self, model=self.model.over(devices))

    def at(self, time):
        return dataclasses.replace(self, model=self.model.at(time))

    def prepare(self, state):
        return self.model.prepare(state.particles)

    def refresh(self, auxiliary, state, time_step):
        return self.model.refresh(auxiliary, state.particles, time_step)

    def begin(self, state):
        particles, auxiliary = self.model.begin(state.particles)
        return dataclasses.replace(state, particles=particles), auxiliary

    def keep_up(self, state, auxiliary, time_step):
        particles, auxiliary = self.model.keep_up(state.particles, auxiliary, time_step)
        return dataclasses.replace(state, particles=particles), auxiliary

    def end(self, state, auxiliary):
        return dataclasses.replace(state, particles=self.model.end(state.particles, auxiliary))

    def finish(self, state):
        return dataclasses.replace(state, particles=self.model.finish(state.particles))

    def inspect(self, step, state, auxiliary):
        return self.model.inspect(step, state.particles, auxiliary)

    def step_limit(self, state, change):
        return self.model.step_limit(state.particles, change)

    def largest_change(self, old, new):
        return self.model.largest_change(old.particles, new.particles)

    def observe(self, state) -> Snapshot:
        return self.model.observe(state.particles)
