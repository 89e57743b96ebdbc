"""Which equations a flow on reference points obeys, one formulation a class."""

from __future__ import annotations

import abc
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import final

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxsph import SimulationError
from jaxsph.scenes import Scene

from ...basis import Basis, Centring, Energy, InnerProduct, pod
from ...reference import ReferenceSpace
from ..dynamics.fixed_points import on_points
from ..dynamics.reference_operators import ReferenceOperators
from ..dynamics.solenoidal import solenoidal_basis
from ..prediction.recovery import fit_recovery
from ..prediction.reduced_flow import ReducedFlow
from .closure import ProjectedRun

_CROSSINGS = 3.0  # of the box by sound, before which pressure is that of a sudden start


class Formulation(abc.ABC):
    """How a flow is made of full runs before its closure is learnt, and what is left to do after.

    `mapped` are the runs' (r, u) on the reference points, each (G, F, S).
    """

    @property
    @abc.abstractmethod
    def name(self) -> str:
        """As users type it."""

    @abc.abstractmethod
    def basis(
        self,
        scene: Scene,
        reference: ReferenceSpace,
        mapped: Sequence[np.ndarray],
        modes: int | None,
    ) -> Basis:
        """Modes of (r, u), as many as there are if no number is given; the first of them are those
        of fewer modes."""

    @abc.abstractmethod
    def finished(
        self,
        flow: ReducedFlow,
        scene: Scene,
        projected: Sequence[ProjectedRun],
        mapped: Sequence[np.ndarray],
    ) -> ReducedFlow:
        """The flow as it is used."""


@final
@dataclass(frozen=True)
class Compressible(Formulation):
    """The weakly compressible equations as they are, sound included.

    Args:
        product: of POD and projection.
        centring: the product's own if none is given.
        decompose: `pod` or `block_pod`.
    """

    product: InnerProduct = field(default_factory=Energy)
    centring: Centring | None = None
    decompose: Callable[..., Basis] = pod

    @property
    def name(self):
        return "compressible"

    def basis(self, scene, reference, mapped, modes):
        snapshots = np.concatenate(mapped, axis=-1)
        return self.decompose(snapshots, self.product, scene.fluid, modes, self.centring)

    def finished(self, flow, scene, projected, mapped):
        return flow


@final
@dataclass(frozen=True)
class Solenoidal(Formulation):
    """The momentum equation in velocity modes without divergence, which feel no pressure; velocity
    and pressure are recovered from the coordinates (`Recovery`).

    Next to walls, where a mapped velocity has a divergence that the particles did not have, this
    is what is left of the equations that makes sense. There is no sound.

    Args:
        density_modes: of the recovered pressure.
    """

    density_modes: int = 10

    def __post_init__(self):
        if self.density_modes < 1:
            raise ValueError(f"density_modes: at least 1, got {self.density_modes}.")

    @property
    def name(self):
        return "solenoidal"

    def basis(self, scene, reference, mapped, modes):
        operators = ReferenceOperators.of(on_points(scene), reference.points)
        return solenoidal_basis(np.concatenate(mapped, axis=-1), operators, modes)

    def finished(self, flow, scene, projected, mapped):
        interval = scene.schedule.interval
        crossing = max(scene.space.box.lengths) / float(scene.fluid.sound_speed)
        last = min(len(run.coordinates) for run in projected) - 1
        recovery = fit_recovery(
            mapped,
            projected,
            [_predicted(flow, scene, run) for run in projected],
            self.density_modes,
            first=min(round(_CROSSINGS * crossing / interval), last // 2),
        )
        return eqx.tree_at(lambda f: f.recovery, flow, recovery, is_leaf=lambda x: x is None)


def formulation_for(scene: Scene, product: InnerProduct, closed: bool) -> Formulation:
    """What suits a scene (`benchmarks.walled_rom`).

    Between walls and without a closure pressure is better by solenoidal modes; with one it is
    best by the equations as they are.
    """
    return Solenoidal() if scene.walls is not None and not closed else Compressible(product)


def _predicted(
    flow: ReducedFlow, scene: Scene, run: ProjectedRun
) -> Float[np.ndarray, "times modes"]:
    """Coordinates of a run by the flow itself, or its own where the flow is lost."""
    start = run.coordinates[:1]
    schedule = replace(scene.schedule, intervals=len(run.coordinates) - 1)
    try:
        return np.concatenate([start, flow.predict(jnp.asarray(start[0]), run.values, schedule)])
    except SimulationError:
        return run.coordinates
