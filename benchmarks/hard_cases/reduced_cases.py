"""Hard cases of reduced models: too few or too many modes, useless snapshots, wild memories."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial

import equinox as eqx
import numpy as np
from jaxtyping import Float

from jaxsph import Trajectory, run_scene
from jaxsph.integrate import FaultCode
from jaxsph.scenes import Scene, taylor_green
from jaxsph.schemes import DeltaPlus
from jaxsph_rom import (
    AdjointPetrovGalerkin,
    Basis,
    Centring,
    Energy,
    Euclidean,
    Galerkin,
    InnerProduct,
    LocalSplines,
    MeanCentred,
    Projection,
    ReducedModel,
    ReferenceSpace,
    SpectralMemory,
    pod,
)

from .bounds import DECAY, LOOSE_DENSITY
from .judge import Case, Ending, Run

_MODES = 4  # of cases that are not about their number
_BOUNDED = (LOOSE_DENSITY, DECAY)
_ANY = (Ending.FINISHED, Ending.FAULT)

Snapshots = Float[np.ndarray, "points fields times"]


@cache
def full_run() -> tuple[Scene, Trajectory]:
    """The run that all bases are made of: 16 x 16, Re = 100, 21 snapshots to 0.4 s."""
    scene = taylor_green(16, end_time=0.4, scheme=DeltaPlus(), dtype="float64")
    return scene, run_scene(scene)


@cache
def trained() -> tuple[Scene, ReferenceSpace, Snapshots]:
    """Its snapshots on the places where it starts."""
    scene, run = full_run()
    reference = ReferenceSpace(scene.state.position, scene.space)
    return scene, reference, reference.snapshots(run)


def _of_snapshots(
    choose: Callable[[Snapshots], Snapshots],
    modes: int | None = _MODES,
    product: InnerProduct | None = None,
    centring: Centring | None = None,
) -> Run:
    """A Galerkin model of the POD of some of the snapshots."""
    scene, _, snapshots = trained()
    product = Energy() if product is None else product
    basis = pod(choose(snapshots), product, scene.fluid, modes, centring)
    return _reduced(basis, Galerkin())


def _of_modes(change: Callable[[np.ndarray], np.ndarray]) -> Run:
    """A Galerkin model whose modes are spoilt after the POD."""
    return _reduced(_spoilt(change), Galerkin())


def _with_memory(tau: float) -> Run:
    return _reduced(_spoilt(lambda modes: modes), AdjointPetrovGalerkin(tau))


def _with_found_memory() -> Run:
    """Petrov-Galerkin whose memory length is looked for in dependent modes."""
    scene = trained()[0]
    model = _model(_spoilt(_twice), Galerkin())
    tau = SpectralMemory()(model, eqx.filter_jit(model.project)(scene.state))
    return _reduced(_spoilt(_twice), AdjointPetrovGalerkin(tau))


def _spoilt(change) -> Basis:
    scene, _, snapshots = trained()
    basis = pod(snapshots, Energy(), scene.fluid, _MODES)
    return eqx.tree_at(lambda b: b.modes, basis, change(basis.modes))


def _model(basis: Basis, projection: Projection) -> ReducedModel:
    scene, reference, _ = trained()
    points = np.asarray(reference.points)
    splines = LocalSplines.fit(points, basis.functions.reshape(len(points), -1), scene.space)
    return ReducedModel.of_scene(scene, basis, splines, projection)


def _reduced(basis: Basis, projection: Projection) -> Run:
    scene, model = trained()[0], _model(basis, projection)
    start = eqx.filter_jit(model.project)(scene.state)
    return Run(scene, scene.schedule, model, start)


def _every(snapshots: Snapshots) -> Snapshots:
    return snapshots


def _first(count: int, snapshots: Snapshots) -> Snapshots:
    return snapshots[..., :count]


def _four_times(snapshots: Snapshots) -> Snapshots:
    return np.repeat(snapshots[..., :3], 4, axis=2)


def _constant(snapshots: Snapshots) -> Snapshots:
    return np.repeat(snapshots[..., :1], 6, axis=2)


def _resting(snapshots: Snapshots) -> Snapshots:
    at_rest = np.zeros_like(snapshots[..., :6])
    at_rest[:, 0] = float(trained()[0].fluid.reference_density)
    return at_rest


def _lost(snapshots: Snapshots) -> Snapshots:
    lost = snapshots.copy()
    lost[3, 0, 5] = np.nan
    return lost


def _twice(modes: np.ndarray) -> np.ndarray:
    return np.concatenate([modes[:, :, :2], modes[:, :, :2]], axis=2)


def _last_zero(modes: np.ndarray) -> np.ndarray:
    return modes * (np.arange(modes.shape[2]) < modes.shape[2] - 1)


_REFUSED = (Ending.REFUSED,)
_NOT_FINITE = {"endings": (Ending.FAULT,), "codes": (FaultCode.NOT_FINITE,), "says": "not finite"}
_TAUS = (("1e-9", 1e-9), ("1", 1.0), ("1e3", 1e3), ("minus-1e-4", -1e-4), ("minus-1", -1.0))

OF_SNAPSHOTS = (
    Case("reduced/one-mode", "M = 1", partial(_of_snapshots, _every, 1), _BOUNDED),
    Case("reduced/all-modes", "M = 21, as many as snapshots, energy product",
         partial(_of_snapshots, _every, None), _BOUNDED),
    Case("reduced/all-modes-euclidean", "M = 21 in the paper's product, which is not stable",
         partial(_of_snapshots, _every, None, Euclidean()), _BOUNDED, endings=_ANY,
         says="left its bounds"),
    Case("reduced/one-snapshot", "a basis of the start alone",
         partial(_of_snapshots, partial(_first, 1), 1), _BOUNDED),
    Case("reduced/too-few-snapshots", "4 modes asked of 2 snapshots",
         partial(_of_snapshots, partial(_first, 2)), endings=_REFUSED,
         says="modes: 4 asked for, but 2 snapshots give 1 to 2; .* record more snapshots"),
    Case("reduced/no-snapshots", "a basis of no snapshots at all",
         partial(_of_snapshots, partial(_first, 0), None), endings=_REFUSED, says="snapshots"),
    Case("reduced/duplicates", "3 snapshots, each four times, and 4 modes of them",
         partial(_of_snapshots, _four_times), endings=_REFUSED, says="modes"),
    Case("reduced/constant", "one snapshot six times, and 4 modes of them: 3 are noise",
         partial(_of_snapshots, _constant), endings=_REFUSED, says="modes"),
    Case("reduced/constant-about-mean", "the same about their mean: all 4 modes are noise",
         partial(_of_snapshots, _constant, centring=MeanCentred()), endings=_REFUSED,
         says="snapshots"),
    Case("reduced/all-at-rest", "snapshots that are all the centre: nothing to make modes of",
         partial(_of_snapshots, _resting), _BOUNDED, endings=(*_ANY, Ending.REFUSED)),
    Case("reduced/nan-snapshot", "one NaN among the snapshots",
         partial(_of_snapshots, _lost), endings=_REFUSED,
         says="snapshots: a value is not finite"),
)  # fmt: skip

OF_MODES = (
    Case("reduced/rank-deficient", "2 modes, each twice",
         partial(_of_modes, _twice), **_NOT_FINITE),
    Case("reduced/zero-mode", "a mode that is zero",
         partial(_of_modes, _last_zero), **_NOT_FINITE),
    *(Case(f"reduced/tau-{name}", f"memory length of {tau:g} s, where 1e-4 s is usual",
           partial(_with_memory, tau), _BOUNDED, endings=_ANY) for name, tau in _TAUS),
    Case("reduced/tau-nan", "memory length NaN", partial(_with_memory, np.nan), **_NOT_FINITE),
    Case("reduced/tau-of-dependent-modes", "memory length looked for in dependent modes",
         _with_found_memory, endings=_REFUSED, says="tau: .* give a number"),
)  # fmt: skip

REDUCED = (*OF_SNAPSHOTS, *OF_MODES)
