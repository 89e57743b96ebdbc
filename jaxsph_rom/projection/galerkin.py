"""Galerkin projection."""

from .base import Projection


class Galerkin(Projection):
    """d(w^)/dt = Phi^+ f-bar(Phi w^) (paper, eq. Galerkin)."""

    @property
    def name(self):
        return "galerkin"

    def reduce(self, inverse, functional, state):
        rates, beside = functional(state)
        return inverse(rates), beside
