"""What an arrangement is."""

from __future__ import annotations

import abc
from dataclasses import dataclass

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..pairs import Space
from ..record import record


@dataclass(frozen=True)
class Arrangement(abc.ABC):
    """A rule that fills a box with particles of equal volume."""

    @abc.abstractmethod
    def positions(self, space: Space) -> Float[Array, "particles dim"]:
        """Positions [m] that fill `space.box` at the spacing of `space`, outside jit."""

    def places(self, space: Space) -> Float[Array, "particles dim"]:
        """The places [m] that tell which particles belong to a part of the box: those of the
        lattice, unless a rule has its own."""
        return jnp.asarray(space.lattice())

    def record(self) -> dict:
        """The rule and its settings, JSON-like."""
        kept = record(self)
        return {"rule": kept} if isinstance(kept, str) else kept
