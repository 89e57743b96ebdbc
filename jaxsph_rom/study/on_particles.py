"""Reduced models on moving particles."""

from __future__ import annotations

import dataclasses
import time as clock
from dataclasses import dataclass
from functools import cache, partial
from typing import Any, final

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from jaxsph import ParticleState, SimulationError, Snapshot, Trajectory
from jaxsph.interpolation import KernelMap, QuadraticMap, ShepardMap
from jaxsph.io import read_trajectory
from jaxsph.kept_run import kept_run
from jaxsph.metrics import probe
from jaxsph.simulate import first_doubt

from ..basis import Basis, Centring, Energy, Euclidean, InnerProduct
from ..field_advection import Advection, ModeAdvection, PaperAdvection
from ..mode_interpolation import ModeInterpolation
from ..model import ReducedModel, ReducedState
from ..projection import AdjointPetrovGalerkin, Galerkin, MemoryLength, Projection
from ..splines import LocalSplines
from .full_runs import FullRuns
from .method import Experiment, Method, ModelBasis, ReducedRun
from .recorded_run import with_record
from .watch import TrainedPressure


@final
@dataclass(frozen=True)
class OnParticles(Method):
    """Models whose modes are carried to moving particles; what measures best unless told otherwise.

    Args:
        projections: to compare. A `MemoryLength` among them stands for the adjoint Petrov-Galerkin
            projection with the memory length that it finds for each run.
        product: inner product of the POD and the projection.
        advection: how the Eulerian functional is made.
        rule: of the map to the reference points.
        interpolation: of the modes, from the reference points back to particles; besides
            `LocalSplines` there is `LatticePolynomials`, where particles start on a lattice.
        spline_order: of the interpolation's splines or polynomials.
        centring: of the POD; the product's own if none is given.
    """

    projections: tuple[Projection | MemoryLength, ...] = (Galerkin(),)  # noqa: RUF009
    product: InnerProduct = Energy()  # noqa: RUF009
    advection: Advection = ModeAdvection()  # noqa: RUF009
    rule: type[KernelMap] = QuadraticMap
    interpolation: type[ModeInterpolation] = LocalSplines
    spline_order: int = 3
    centring: Centring | None = None

    @property
    def product_name(self):
        """The inner product, and the centring if it is not the product's own."""
        product, own = type(self.product).__name__, type(self.product.centring)
        same = self.centring is None or isinstance(self.centring, own)
        return product if same else f"{product}-{type(self.centring).__name__}"

    def check(self, runs, experiment):
        scene = runs.scene(experiment.trained_on[0])
        points = np.asarray(scene.state.position)
        self.interpolation.check(points, scene.space, self.spline_order)
        self.advection.eulerian(scene.effects)
        runs.reference(experiment.trained_on[0], self.rule)

    def basis(self, runs: FullRuns, experiment: Experiment, modes: int | None = None) -> Basis:
        """POD basis of the training runs on the reference space."""
        options = self.rule, self.product, self.centring, modes
        return runs.basis(experiment.trained_on, *options)

    def run(self, runs, experiment):
        for reynolds in dict.fromkeys(experiment.trained_on + experiment.reynolds):
            runs.full(reynolds)
        before = clock.perf_counter()
        basis = self.basis(runs, experiment, max(experiment.modes))
        made_of = cache(partial(self._made_of, runs, experiment))
        scene = runs.scene(experiment.trained_on[0])
        points = np.asarray(scene.state.position)
        values = basis.functions.reshape(len(points), -1)
        numbers = np.arange(values.shape[1]).reshape(basis.modes.shape[1], -1)
        interpolation = self.interpolation.fit(points, values, scene.space, self.spline_order)
        told = {
            "trained_on": experiment.trained_on,
            "offline_seconds": clock.perf_counter() - before,
        }
        for modes in experiment.modes:
            part = basis.truncated(modes)
            kept = interpolation.select(
                np.delete(numbers, np.s_[modes : basis.size], axis=1).reshape(-1)
            )
            for reynolds in experiment.reynolds:
                for projection in self.projections:
                    parts = part, kept, projection
                    *run, more, held = self._reduced(
                        runs, experiment.trained_on, reynolds, *parts
                    )
                    yield ReducedRun(reynolds, *run, told | more, made_of, projected=held)

    def _made_of(self, runs: FullRuns, experiment: Experiment) -> ModelBasis:
        of_all = experiment.trained_on, self.product, self.centring
        record = self._record()
        return ModelBasis(
            self.basis(runs, experiment),
            runs.lagrangian_basis(*of_all),
            runs.reference(experiment.trained_on[0], self.rule),
            {name: record[name] for name in ("advection", "interpolation", "spline_order")},
        )

    def _reduced(self, runs, trained_on, reynolds, basis, interpolation, projection):
        """Trajectory, profile and fault of a run, what else there is to tell, and the profile of
        the full run in the same basis."""
        scene = runs.scene(reynolds)
        first = trained_on[0]
        trained = ((runs.full(r).time, runs.mapped(r, first, self.rule)) for r in trained_on)
        watch = TrainedPressure.of(basis, scene.fluid, trained)
        rule = projection if isinstance(projection, MemoryLength) else None
        if rule is not None:
            projection = self._petrov_galerkin(rule, scene, basis, interpolation)
        tau = float(projection.tau) if isinstance(projection, AdjointPetrovGalerkin) else None
        name = projection.name if tau is None else f"{projection.name}-{tau:g}"
        name = name if rule is None else f"{projection.name}-{rule.label}"
        told = {
            "modes": basis.size,
            "projection": projection.name,
            "tau": tau,
            "trained_on": trained_on,
        }
        recorded = with_record(
            scene, reduced={**told, "trained_on": list(trained_on), **self._record()}
        )

        def restore(trajectory):
            return ReducedState(
                jnp.asarray(trajectory.coordinates[-1]), jnp.asarray(trajectory.position[-1])
            )

        numbers = "-".join(f"{r:g}" for r in trained_on)
        path = runs.folder / "reduced" / f"{self._label}-{numbers}" / f"re-{reynolds:g}"
        path = path / f"m-{basis.size}-{name}.h5"
        label = f"reduced model, Re {reynolds:g}, M = {basis.size}, {name}"
        model = ReducedModel.of_scene(scene, basis, interpolation, projection, self.advection)
        fault = None
        try:
            run = kept_run(
                path,
                recorded,
                lambda: model,
                lambda model: _held(model, scene.state)[0],
                restore,
                lambda done: runs.progress(label, scene.steps, done),
                {
                    "training": runs.digests(trained_on),
                    "method": dataclasses.replace(self, projections=()),
                    "projection": projection,
                },
                watch=watch,
            )
        except SimulationError as error:
            fault, run = error, read_trajectory(path)
        told |= first_doubt(watch, run) | {
            "memory": None if rule is None else rule.label,
            "hyper": "none",
            "rom_seconds": run.timing.seconds(scene.steps) if fault is None else None,
            "rom_compile_seconds": run.metadata.get("compile_seconds"),
        }
        probes, full = runs.probes(reynolds), runs.full(reynolds)
        profile = probe(run, probes, scene.space)
        return run, profile, fault, told, probe(held_by(model, full), probes, scene.space)

    def _petrov_galerkin(self, memory, scene, basis, interpolation) -> AdjointPetrovGalerkin:
        model = ReducedModel.of_scene(scene, basis, interpolation, Galerkin(), self.advection)
        tau = memory(model, _held(model, scene.state)[0])
        # rounded, so that a run that is taken up again finds the very number that it recorded
        return AdjointPetrovGalerkin(jnp.asarray(float(f"{tau:.4g}"), scene.state.density.dtype))

    @property
    def _label(self) -> str:
        """A name for folders: what differs from the paper's, and the product."""
        parts = [self.product_name.lower()]
        if self.advection != FAITHFUL.advection:
            parts.append(self.advection.name)
        if self.rule is not FAITHFUL.rule:
            parts.append(self.rule.__name__.removesuffix("Map").lower())
        if self.interpolation is not FAITHFUL.interpolation:
            parts.append(self.interpolation.__name__.lower())
        if self.spline_order != FAITHFUL.spline_order:
            parts.append(f"order-{self.spline_order}")
        return "-".join(parts)

    def _record(self) -> dict[str, Any]:
        """The choices in words."""
        return {
            "inner_product": self.product_name,
            "advection": self.advection.name,
            "spline_order": self.spline_order,
            "map": self.rule.__name__,
            "interpolation": self.interpolation.__name__,
        }


@eqx.filter_jit  # compiled once for the start and for all snapshots
def _held(model: ReducedModel, state: ParticleState) -> tuple[ReducedState, Snapshot]:
    """The reduced state nearest to a full one, and its fields at the same particles."""
    reduced = model.project(state)
    return reduced, model.observe(reduced)


def held_by(model: ReducedModel, full: Trajectory) -> Trajectory:
    """A full run as a model's modes hold it at the run's own particles: no model of these modes is
    nearer to it for long.

    Args:
        model: its basis and map count.
        full: the run.
    """
    held = [_held(model, full.state(k))[1] for k in range(len(full.time))]
    fields = {
        name: np.stack([np.asarray(getattr(snapshot, name)) for snapshot in held])
        for name in ("velocity", "density", "pressure")
    }
    return dataclasses.replace(full, **fields)


# the source paper's, as printed
FAITHFUL = OnParticles(product=Euclidean(), advection=PaperAdvection(), rule=ShepardMap)
