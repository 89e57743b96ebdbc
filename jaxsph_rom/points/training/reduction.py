"""How a reduced model's rates are made cheap, one way a class."""

from __future__ import annotations

import abc
from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Float

from jaxsph.scenes import Scene

from ...basis import Basis
from ..dynamics.base import Dynamics
from ..dynamics.coefficients import Coefficients
from ..dynamics.eulerian_rates import EulerianRates
from ..dynamics.opened import Opened
from ..dynamics.quadratic_system import projected
from ..dynamics.rate_snapshots import VisitedStates, rate_basis
from ..dynamics.reference_operators import ReferenceOperators
from ..dynamics.sampled_rates import SampledRates
from ..dynamics.sampling import NonNegativeWeights, Sampling
from .closure import ProjectedRun

_SAMPLES_PER_MODE = 8


class Reduction(abc.ABC):
    """What makes the dynamics of a basis."""

    @property
    @abc.abstractmethod
    def name(self) -> str:
        """As users type it."""

    @abc.abstractmethod
    def prepared(
        self,
        scene: Scene,
        points: Float[np.ndarray, "points dim"],
        coefficients: Coefficients,
        values: Float[np.ndarray, "scenes coefficients"],
    ):
        """What is known before any full run.

        Args:
            scene: the first.
            points: of the reference space.
            coefficients: that scenes differ in.
            values: theta of the scenes.

        Raises:
            ValueError: if scenes like these cannot be reduced so.
        """

    @abc.abstractmethod
    def dynamics(
        self,
        prepared,
        scene: Scene,
        basis: Basis,
        runs: Sequence[ProjectedRun],
    ) -> Dynamics:
        """The dynamics in a basis.

        Args:
            prepared: as `prepared` gave it.
            scene: the first.
            basis: of (r, u) on the reference points.
            runs: in its coordinates.
        """


@final
@dataclass(frozen=True)
class Tensors(Reduction):
    """Constant tensors: exact where rates are quadratic, and by far the fastest."""

    @property
    def name(self):
        return "tensors"

    def prepared(self, scene, points, coefficients, values):
        operators = ReferenceOperators.of_scene(scene, points, coefficients)
        return operators, Opened.found(operators, values)

    def dynamics(self, prepared, scene, basis, runs):
        operators, opened = prepared
        return projected(operators, basis, opened=opened)


@final
@dataclass(frozen=True)
class Samples(Reduction):
    """Rates as they are at a few points: for any effect, any equation of state, forces in time.

    Args:
        sampling: which points, or how many by `NonNegativeWeights`; eight a mode if none is given.
    """

    sampling: Sampling | int | None = None

    @property
    def name(self):
        return "samples"

    def prepared(self, scene, points, coefficients, values):
        return EulerianRates.of_scene(scene, points, coefficients)

    def dynamics(self, prepared, scene, basis, runs):
        interval = scene.schedule.interval
        visited = [
            VisitedStates(run.values, interval * np.arange(len(run.coordinates)), run.coordinates)
            for run in runs
        ]
        rule = self._rule(basis.size, len(prepared.points))
        samples = rule.choose(basis, rate_basis(prepared, basis, visited))
        return SampledRates.of_samples(prepared, basis, samples)

    def _rule(self, modes: int, points: int) -> Sampling:
        if isinstance(self.sampling, Sampling):
            return self.sampling
        wanted = _SAMPLES_PER_MODE * modes if self.sampling is None else self.sampling
        return NonNegativeWeights(min(wanted, points) if self.sampling is None else wanted)
