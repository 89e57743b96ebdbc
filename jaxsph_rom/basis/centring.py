"""The state from which fluctuations are taken."""

from __future__ import annotations

import abc

import equinox as eqx
import numpy as np
from jaxtyping import Float

from jaxsph import Fluid


class Centring(eqx.Module):
    """A rule for the centre w_c of snapshots; modes are of the fluctuations w - w_c."""

    @property
    @abc.abstractmethod
    def of_snapshots(self) -> bool:
        """Whether the centre depends on the snapshots, not on the fluid alone."""

    @abc.abstractmethod
    def centre(
        self, snapshots: Float[np.ndarray, "points fields times"], fluid: Fluid
    ) -> Float[np.ndarray, "#points fields"]:
        """w_c of fields (rho, u), a single row where it is the same at all points."""


class Uncentred(Centring):
    """w_c = 0, the paper's."""

    @property
    def of_snapshots(self):
        return False

    def centre(self, snapshots, fluid):
        return np.zeros((1, snapshots.shape[1]), fluid.reference_density.dtype)


class RestCentred(Centring):
    """w_c = (rho0, 0), the state of rest."""

    @property
    def of_snapshots(self):
        return False

    def centre(self, snapshots, fluid):
        centre = np.zeros((1, snapshots.shape[1]), fluid.reference_density.dtype)
        centre[:, 0] = fluid.reference_density
        return centre


class MeanCentred(Centring):
    """w_c = sum_k w(t_k) / S, the mean of all snapshots at each point."""

    @property
    def of_snapshots(self):
        return True

    def centre(self, snapshots, fluid):
        return snapshots.mean(axis=2)
