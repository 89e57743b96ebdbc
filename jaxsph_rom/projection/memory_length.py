"""Rules for the memory length of the adjoint Petrov-Galerkin projection."""

from __future__ import annotations

import abc
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, final

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsph.compiled import full_precision

from ..field_advection import ModeAdvection
from .spectral_radius import krylov_projection, spectral_radius

if TYPE_CHECKING:
    from ..model import ReducedModel, ReducedState

_STEPS = 20  # actions of the Jacobian at most; with as many modes or fewer nothing is left out
_RESTING = 1e-6  # of the reference speed over the box: slower than this is rounding


@dataclass(frozen=True)
class MemoryLength(abc.ABC):
    """tau = C / |lambda_max| of a projected Jacobian (Parish et al. 2020, C about 0.2).

    It is found once, on the host, from the state that a run starts from: its price is that of some
    20 right-hand sides with their tangents, more than a time step's. A memory length that is known
    beforehand is `AdjointPetrovGalerkin(tau)` and needs no rule.

    Args:
        constant: C.

    Raises:
        ValueError: if the constant is not positive.
    """

    constant: float = 0.2

    def __post_init__(self):
        if not 0.0 < self.constant < np.inf:
            raise ValueError(f"constant: must be positive, got {self.constant:g}.")

    @property
    @abc.abstractmethod
    def name(self) -> str:
        """As users type it."""

    @property
    def label(self) -> str:
        """Name and constant, as files are named."""
        return f"{self.name}-{self.constant:g}"

    @abc.abstractmethod
    def kept(self, model: ReducedModel) -> ReducedModel:
        """The model with that part of f-bar alone whose Jacobian counts."""

    def __call__(self, model: ReducedModel, state: ReducedState) -> float:
        """tau [s].

        Args:
            model: with any projection; its own is not used.
            state: where the Jacobian is taken.

        Raises:
            ValueError: if the spectral radius is not finite, or that of a state at rest.
        """
        count = state.coordinates.shape[0]
        found = np.asarray(_restricted(self.kept(model), state, min(count, _STEPS)))
        radius = spectral_radius(found) if np.isfinite(found).all() else np.nan
        lengths, speed = model.functional.space.box.lengths, model.functional.fluid.reference_speed
        if not radius > _RESTING * float(speed) / max(lengths):
            raise ValueError(
                f"tau: the projected Jacobian's spectral radius is {radius:.3g} 1/s, lost or that "
                f"of a state at rest ({self.name}); give a number."
            )
        return self.constant / radius


@final
class SpectralMemory(MemoryLength):
    """C / |lambda_max| of Phi^+ J Phi, J the Jacobian of all of f-bar at frozen positions.

    In a weakly compressible flow |lambda_max| is a frequency of sound.
    """

    @property
    def name(self):
        return "auto"

    def kept(self, model):
        return model


@final
class ConvectiveMemory(MemoryLength):
    """C / |lambda_max| of Phi^+ J Phi, J the Jacobian of the advection of fields alone.

    Without pressure, viscosity and density terms |lambda_max| is a frequency of the flow.
    """

    @property
    def name(self):
        return "convective"

    def kept(self, model):
        still = replace(model.functional, effects=())
        return replace(model, functional=still, advection=ModeAdvection())


def projected_jacobian(
    model: ReducedModel, state: ReducedState
) -> Callable[[Float[Array, " modes"]], Float[Array, " modes"]]:
    """v -> Phi^+ J Phi v at the state's positions, J the Jacobian of f-bar; by `jax.linearize`.

    Args:
        model: its projection is not used.
        state: where the Jacobian is taken.
    """
    auxiliary = model.prepare(state)
    modes, centre = model.basis_at(state.position)
    inverse = model.pseudo_inverse(modes)
    start = jnp.zeros((), state.coordinates.dtype)  # forces in time do not depend on the state

    def rates(coordinates):
        stacked = (centre + modes @ coordinates).reshape(-1)
        rates, _ = model.stacked_rates(start, stacked, state.position, auxiliary, coordinates)
        return inverse(rates)

    return jax.linearize(rates, state.coordinates)[1]


@eqx.filter_jit
@full_precision
def _restricted(model, state, steps: int):
    # an arbitrary direction, the same each time, so that runs repeat
    start = np.random.default_rng(0).normal(size=state.coordinates.shape)
    start = jnp.asarray(start, state.coordinates.dtype)
    return krylov_projection(projected_jacobian(model, state), start, steps)
