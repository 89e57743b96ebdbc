"""The full functional at a few particles, which are followed as they move."""

from __future__ import annotations

from typing import final

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.spatial import cKDTree

from jaxsph import ParticleState
from jaxsph.cloud import Cloud
from jaxsph.neighbors import VerletList, WallList

from .inputs import Inputs
from .label_basis import LabelBasis
from .label_system import LabelSystem


@final
class SampledSystem(LabelSystem):
    """da/dt = Phi_x^T S_x u(b) + sum over samples P of B_p (dx/dt - u, du/dt)_p, with the rates of
    the full functional at the state of all modes b = (a, D m(a, p)).

    Galerkin projection on the first M modes of motion, on the manifold that the recovered modes of
    motion and of density make, from the particles P and those that these see, at their places of
    the moment: they are labels, so it is always the same particles. As density is recovered there
    is no sound, and steps are the flow's. The cost is that of a right-hand side on these particles,
    whatever the number of all.

    Args:
        motion, density: modes at the samples, which come first, and at what these see.
        labels: of these (U, n) [m].
        neighbors: list of all pairs that can come within the kernel's support.
        carried: Phi_x^T S_x u of all modes of motion (M, K).
        carried_centre: the same of their centre (M,).
        gather: B (M, P, 2 n).
        recovery: D.
        inputs: p; its functional has the ghosts that the samples see.
    """

    motion: LabelBasis
    density: LabelBasis
    labels: Float[Array, "members dim"]
    neighbors: VerletList | WallList
    carried: Float[Array, "modes all_modes"]
    carried_centre: Float[Array, " modes"]
    gather: Float[Array, "modes samples fields"]
    recovery: Float[Array, "recovered products"]
    inputs: Inputs

    @property
    def size(self) -> int:
        return self.gather.shape[0]

    def rates(
        self,
        time: Float[Array, ""],
        coordinates: Float[Array, " modes"],
        values: Float[Array, " coefficients"],
    ) -> Float[Array, " modes"]:
        """da/dt."""
        others, more = self.recovered(time, coordinates, values), self.motion.size - self.size
        b = jnp.concatenate([coordinates, others[:more]])
        state = state_at(self.motion, self.density, self.labels, b, others[more:])
        functional = self.inputs.coefficients.applied(self.inputs.functional, values)
        found = functional(time, state, self.neighbors)
        rates = jnp.concatenate([found.position - state.velocity, found.velocity], axis=1)
        seen = rates[: self.gather.shape[1]]
        return self.carried @ b + self.carried_centre + jnp.einsum("mpf,pf->m", self.gather, seen)

    def strayed(self, position, labels, space):
        """When a particle is within the kernel's support of a sample that is not followed: it is
        missing in the sample's rates."""
        _, members = cKDTree(labels).query(np.asarray(self.labels))
        samples = members[: self.gather.shape[1]]
        found = np.zeros(len(position), bool)
        for k, place in enumerate(np.asarray(position, float)):
            near = Cloud(place, space.box).around(place[samples], space.support)
            found[k] = len(np.setdiff1d(near, members)) > 0
        return found


def state_at(
    motion: LabelBasis,
    density: LabelBasis,
    labels: Float[Array, "particles dim"],
    of_motion: Float[Array, " modes"],
    of_density: Float[Array, " modes"],
) -> ParticleState:
    """Particles at coordinates of all modes of motion and of density."""
    way, velocity = (part.reshape(labels.shape) for part in jnp.split(motion.numbers(of_motion), 2))
    return ParticleState(labels + way, velocity, density.numbers(of_density))
