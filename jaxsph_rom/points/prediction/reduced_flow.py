"""A reduced model on reference points, from full runs to fields."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import cached_property

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsph import Fluid, Schedule, Trajectory
from jaxsph.compiled import full_precision
from jaxsph.integrate import SimulationError
from jaxsph.interpolation import KernelMap, MovingLeastSquaresMap
from jaxsph.scenes import Scene

from ...basis import Basis, Centring, Energy, InnerProduct, pod
from ...lattice_polynomials import LatticePolynomials, on_lattice
from ...mode_interpolation import ModeInterpolation
from ...reference import ReferenceSpace
from ...splines import LocalSplines
from ..dynamics.base import Dynamics
from ..dynamics.energy_bound import EnergyBound
from ..dynamics.log_density import from_log_density, to_log_density
from ..dynamics.points_model import PointsModel
from ..dynamics.quadratic_system import galerkin_system
from .recovery import Recovery
from .times import EvenTimes


class ReducedFlow(eqx.Module):
    """Basis and dynamics of a flow on reference points; it knows no particles.

    Args:
        reference: reference points and the map to them.
        basis: of (r, u), r the logarithmic density.
        system: of its coordinates, tensors or samples.
        fluid: gives densities their scale.
        recovery: of velocity and pressure where modes are solenoidal; if there is none, fields are
            those of the modes.

    Examples:
        >>> import jax.numpy as jnp
        >>> import jaxsph
        >>> from jaxsph.arrangements import Lattice
        >>> from jaxsph_rom.points import ReducedFlow, mapped_run
        >>> scene = jaxsph.scenes.taylor_green(16, end_time=0.06, arrangement=Lattice())
        >>> run = jaxsph.run_scene(scene)
        >>> flow = ReducedFlow.train(scene, [run], scene.state.position, modes=2)
        >>> start = flow.project(mapped_run(flow.reference, run, scene.fluid))[0]
        >>> viscosity = jnp.asarray(1.0 / 150.0)  # Re = 150; the run was at 100
        >>> coordinates = flow.predict(start, viscosity, scene.schedule)
        >>> fields = flow.fields(coordinates, run.time[1:])
        >>> fields.velocity.shape  # snapshots, points, directions
        (3, 256, 2)
    """

    reference: ReferenceSpace
    basis: Basis
    system: Dynamics
    fluid: Fluid
    recovery: Recovery | None = None

    @classmethod
    def train(
        cls,
        scene: Scene,
        runs: Sequence[Trajectory],
        points: Float[Array, "points dim"],
        modes: int | tuple[int, int],
        product: InnerProduct | None = None,
        rule: type[KernelMap] = MovingLeastSquaresMap,
        centring: Centring | None = None,
        decompose: Callable[..., Basis] = pod,
    ) -> ReducedFlow:
        """Map the runs, decompose them, and project the scene's equations.

        Args:
            scene: whose effects are projected; its viscosity stays a parameter.
            runs: of the full model.
            points: of the reference space.
            modes: how many, as `decompose` takes it.
            product: `Energy()` if none is given.
            rule: of the map.
            centring: the product's own if none is given.
            decompose: `pod` or `block_pod`, or another with their arguments.

        Raises:
            ValueError: as `ReferenceSpace.snapshots` and `decompose`.
        """
        reference = ReferenceSpace(points, scene.space, rule)
        mapped = np.concatenate([mapped_run(reference, run, scene.fluid) for run in runs], axis=-1)
        product = Energy() if product is None else product
        basis = decompose(mapped, product, scene.fluid, modes, centring)
        return cls.of_basis(scene, reference, basis)

    @classmethod
    def of_basis(cls, scene: Scene, reference: ReferenceSpace, basis: Basis) -> ReducedFlow:
        """The scene's equations, projected on a basis of (r, u) on the reference points."""
        system = galerkin_system(scene, basis, reference.points)
        return cls(reference, basis, system, scene.fluid)

    def truncated(self, modes: int) -> ReducedFlow:
        """The reduced model by tensors of the first modes; nothing is projected again, nothing
        recovered.

        Raises:
            ValueError: if there are not so many.
        """
        basis, system = self.basis.truncated(modes), self.system.truncated(modes)
        return ReducedFlow(self.reference, basis, system, self.fluid)

    def project(self, fields: Float[Array, "points fields *times"]) -> Float[Array, "*times modes"]:
        """Coordinates of (r, u) on the reference points, as `mapped_run` gives them."""
        basis = self.basis
        return projection(basis.modes, basis.centre, basis.weights, jnp.asarray(fields))

    @cached_property
    def bound(self) -> EnergyBound:
        """The energy that the flow may have."""
        return EnergyBound.of(self.basis, self.fluid)

    def model(self, values: Float[Array, "*coefficients"]) -> PointsModel:
        """The model at coefficients theta, a viscosity [m^2/s] say, for the time loop."""
        return PointsModel(self.system, values, self.bound)

    def predict(
        self,
        coordinates: Float[Array, " modes"],
        values: Float[Array, "*coefficients"],
        schedule: Schedule,
    ) -> Float[Array, "snapshots modes"]:
        """Coordinates after each interval, by the full model's loop.

        Raises:
            SimulationError: if they are not finite or leave the bound on energy; it names the step.
        """
        model = self.model(jnp.asarray(values, coordinates.dtype))
        found, fault, _ = _run(EvenTimes.of(schedule, coordinates.dtype), model, coordinates)
        if int(fault.code) != 0:
            raise SimulationError(fault, schedule.time_step)
        return found

    def fields(
        self,
        coordinates: Float[Array, "times modes"],
        time: Float[np.ndarray, " times"],
        points: Float[np.ndarray, "points dim"] | None = None,
        fluid: Fluid | None = None,
    ) -> Trajectory:
        """Fields at the times of the coordinates, at the reference points or at others; traceable.

        Other points get the modes by interpolation that is exact at the reference points: what was
        smoothed once by the map is not smoothed again.

        Args:
            coordinates: (S, M).
            time: (S,) [s].
            points: (P, n) [m]; the reference points if none are given.
            fluid: that gives the pressure; the flow's own if none is given.

        Raises:
            ValueError: if the points crowd a cell of the splines.
        """
        functions = self.functions
        if points is None:
            points = np.asarray(self.reference.points)
        else:
            functions = self._at(points)
        fluids = self.fluid, self.fluid if fluid is None else fluid
        fields, density, pressure = _shown(self.shown, functions, jnp.asarray(coordinates), fluids)
        found = (time, fields[..., 1:], density, pressure, coordinates)
        if not any(isinstance(a, jax.core.Tracer) for a in found):
            found = tuple(map(np.asarray, found))
        time, velocity, density, pressure, coordinates = found
        position = np.broadcast_to(points, (len(time), *points.shape))
        return Trajectory(time, position, velocity, density, pressure, coordinates)

    @property
    def shown(self) -> Basis | Recovery:
        """What fields are made by; without singular values, whose number is that of the runs and
        would compile anew what one run is left out of."""
        if self.recovery is not None:
            return self.recovery
        return dataclasses.replace(self.basis, singular_values=np.zeros(0))

    @property
    def functions(self) -> Float[np.ndarray, "points functions"]:
        """Of these, the functions on the reference points."""
        return np.asarray(self.shown.functions).reshape(len(self.reference.points), -1)

    def interpolation(self, margin: float = 1.3) -> ModeInterpolation:
        """Of the functions: cubic polynomials where the reference points are a lattice, which costs
        less and is as accurate (`benchmarks.mode_interpolation`), local splines elsewhere.

        Args:
            margin: room for particles per cell of splines, over the number in a full one.
        """
        points, space = np.asarray(self.reference.points), self.reference.space
        if on_lattice(points, space):
            return LatticePolynomials.fit(points, self.functions, space)
        return LocalSplines.fit(points, self.functions, space, margin=margin)

    def _at(self, points) -> Float[Array, "places functions"]:
        interpolation = self.interpolation()
        points = jnp.asarray(points, self.reference.points.dtype)
        if bool(interpolation.overflow(points)):
            raise ValueError("points: too many in one cell of the splines; ask for some at a time.")
        return interpolation(points)


@eqx.filter_jit
@full_precision
def _run(times, model, coordinates):
    return times.run(model, coordinates)


def mapped_run(
    reference: ReferenceSpace, run: Trajectory, fluid: Fluid
) -> Float[np.ndarray, "points fields times"]:
    """(r, u) of a full run on the reference points, r the logarithmic density."""
    snapshots = reference.snapshots(run)
    log_density = jax.jit(to_log_density)(jnp.asarray(snapshots[:, 0]), fluid)
    return np.concatenate([np.asarray(log_density)[:, None], snapshots[:, 1:]], axis=1)


@eqx.filter_jit
@full_precision
def projection(modes, centre, weights, fields) -> Float[Array, "*times modes"]:
    """Coordinates of fields (G, F, *times) in a basis, in its product."""
    centre = jnp.broadcast_to(centre, modes.shape[:2])
    weighted = modes * weights[None, :, None]
    constant = jnp.einsum("gfm,gf->m", weighted, centre)
    found = jnp.einsum("gfm,gf...->...m", weighted, fields)
    return found - constant.reshape((1,) * (found.ndim - 1) + (-1,))


@eqx.filter_jit
@full_precision
def _shown(shown, functions, coordinates, fluids):
    """Fields, density and pressure of coordinates."""
    scale, acting = fluids
    matrix, rest = jax.vmap(shown.combination)(coordinates)
    fields = functions @ matrix + rest
    density = from_log_density(fields[..., 0], scale)
    return fields, density, acting.pressure(density)
