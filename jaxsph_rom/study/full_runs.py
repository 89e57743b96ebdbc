"""Full runs by Reynolds number, made once and kept."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numpy as np

from jaxsph import Trajectory
from jaxsph.content import digest
from jaxsph.interpolation import KernelMap
from jaxsph.metrics import centre_line, probe
from jaxsph.scenes import Scene

from ..basis import Centring, InnerProduct, pod
from ..basis.pod import Basis
from ..reference import ReferenceSpace, lagrangian_snapshots
from .recorded_run import Progress, full_run


class FullRuns:
    """Full runs that methods learn from and are compared with, whatever these are.

    Args:
        make: a scene from a Reynolds number.
        folder: where trajectories are kept; what was cut short goes on from there.
        progress: opens a progress bar for each run.
        probes: where runs are compared, (P, n) [m] from a scene; the centre line if none is given.
    """

    def __init__(
        self,
        make: Callable[[float], Scene],
        folder: Path,
        progress: Progress | None = None,
        probes: Callable[[Scene], np.ndarray] | None = None,
    ):
        self.scene = cache(make)
        self.folder = Path(folder)
        self.progress = silent if progress is None else progress
        self._probes = _centre_line if probes is None else probes
        self.full = cache(self._full)
        self.profile = cache(self._profile)
        self.mapped = cache(self._mapped)

    def _full(self, reynolds: float) -> Trajectory:
        return full_run(self.folder / "full", self.scene(reynolds), self.progress)

    def seconds(self, reynolds: float) -> float:
        """Run time of a full run [s], without compilation."""
        return self.full(reynolds).timing.seconds(self.scene(reynolds).steps)

    def probes(self, reynolds: float) -> np.ndarray:
        """Where runs are compared (P, n) [m]."""
        return self._probes(self.scene(reynolds))

    def _profile(self, reynolds: float) -> tuple[np.ndarray, np.ndarray]:
        """Velocity norm and pressure of the full run on the probes over time."""
        return probe(self.full(reynolds), self.probes(reynolds), self.scene(reynolds).space)

    def digests(self, reynolds: tuple[float, ...]) -> list[str]:
        """What tells these scenes from any others."""
        return [digest(self.scene(number)) for number in reynolds]

    def reference(self, first: float, rule: type[KernelMap]) -> ReferenceSpace:
        """The initial configuration of a run, as the points of a reference space."""
        scene = self.scene(first)
        return ReferenceSpace(scene.state.position, scene.space, rule)

    def _mapped(self, reynolds: float, first: float, rule: type[KernelMap]) -> np.ndarray:
        return self.reference(first, rule).snapshots(self.full(reynolds))

    def basis(
        self,
        trained_on: tuple[float, ...],
        rule: type[KernelMap],
        product: InnerProduct,
        centring: Centring | None = None,
        modes: int | None = None,
    ) -> Basis:
        """POD basis of some runs on the reference space of the first."""
        first = trained_on[0]
        matrices = [self.mapped(reynolds, first, rule) for reynolds in trained_on]
        return self._pod(matrices, trained_on, product, centring, modes)

    def lagrangian_basis(
        self,
        trained_on: tuple[float, ...],
        product: InnerProduct,
        centring: Centring | None = None,
        modes: int | None = None,
    ) -> Basis:
        """POD basis of some runs in Lagrangian space, for comparison."""
        matrices = [lagrangian_snapshots(self.full(reynolds)) for reynolds in trained_on]
        return self._pod(matrices, trained_on, product, centring, modes)

    def _pod(self, matrices, trained_on, product, centring, modes) -> Basis:
        fluid = self.scene(trained_on[0]).fluid
        return pod(np.concatenate(matrices, axis=-1), product, fluid, modes, centring)


def _centre_line(scene: Scene) -> np.ndarray:
    return centre_line(scene.space)


@contextmanager
def silent(label: str, total: int, done: int):
    """A progress bar that shows nothing."""
    yield lambda steps: None
