"""Particles that a reduced flow carries along."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsph import Fluid, Snapshot
from jaxsph.full_model import wall_checks
from jaxsph.integrate import Fault, FaultCode, Model
from jaxsph.walls import Walls

from ...basis import Basis
from ...mode_interpolation import ModeInterpolation
from ..dynamics.log_density import from_log_density
from ..dynamics.points_model import PointsModel
from .recovery import Recovery
from .reduced_flow import ReducedFlow

_MARGIN = 2.0  # tracers are not kept apart: cells need more room than those of a full model
_WALL_MARGIN = 0.25  # times dx: none comes nearer to a wall


class TracerState(eqx.Module):
    """Reduced coordinates (M,) and positions of tracers (N, n) [m]; also their rates."""

    coordinates: Float[Array, " modes"]
    position: Float[Array, "particles dim"]


class TracerModel(Model):
    """A reduced flow and tracers in it:

        da/dt = f(t, a; theta),    dx/dt = u(x) = centre(x) + sum_m a_m phi_m(x),

    the modes between the reference points as `ReducedFlow.interpolation` has them. Tracers do not
    act on the flow. As modes do not keep them inside walls, those that come too near are put back
    after each step.

    Args:
        flow: the model of the coordinates.
        interpolation: of what fields are made of.
        shown: makes fields of it, the flow's basis or its recovery.
        fluid: gives densities their scale.
        spacing: of the reference points [m].
        walls: around the fluid, if it has any.
    """

    flow: PointsModel
    interpolation: ModeInterpolation
    shown: Basis | Recovery
    fluid: Fluid
    spacing: float = eqx.field(static=True)
    walls: Walls | None = None

    @classmethod
    def of(cls, flow: ReducedFlow, values: Array, walls: Walls | None = None) -> TracerModel:
        """The model of tracers in a flow at coefficients theta, a viscosity say."""
        interpolation, spacing = flow.interpolation(margin=_MARGIN), flow.reference.space.spacing
        return cls(flow.model(values), interpolation, flow.shown, flow.fluid, spacing, walls)

    def fields_at(
        self,
        position: Float[Array, "particles dim"],
        coordinates: Float[Array, " modes"],
        wanted: slice = slice(None),
    ) -> Float[Array, "particles fields"]:
        """(r, u), or what is wanted of it, at positions; the modes are summed first."""
        matrix, rest = (part[:, wanted] for part in self.shown.combination(coordinates))
        return self.interpolation.combined(matrix)(position) + rest

    def prepare(self, state):
        return None

    def refresh(self, auxiliary, state, time_step):
        return auxiliary

    def rates(self, time, state, auxiliary):
        velocity = self.fields_at(state.position, state.coordinates, slice(1, None))
        return TracerState(self.flow.rates(time, state.coordinates, None), velocity)

    def finish(self, state):
        position = self.interpolation.box.wrap(state.position)
        if self.walls is not None:
            position = self.walls.put_inside(position, _WALL_MARGIN * self.spacing)
        return TracerState(state.coordinates, position)

    def inspect(self, step, state, auxiliary):
        of_flow = self.flow.inspect(step, state.coordinates, None)
        wild = ~jnp.isfinite(jnp.sum(state.position, axis=1))
        of_tracers = Fault.first_of(
            step,
            (FaultCode.NOT_FINITE, jnp.any(wild), jnp.argmax(wild)),
            *wall_checks(self.walls, state.position),
            (FaultCode.SPLINE_CELL_OVERFLOW, self.interpolation.overflow(state.position), -1),
        )
        lost = of_flow.code != int(FaultCode.NONE)
        return Fault(*(
            jnp.where(lost, getattr(of_flow, name), getattr(of_tracers, name))
            for name in ("code", "step", "particle")
        ))  # fmt: skip

    def observe(self, state):
        fields = self.fields_at(state.position, state.coordinates)
        density = from_log_density(fields[:, 0], self.fluid)
        return Snapshot(
            position=state.position,
            velocity=fields[:, 1:],
            density=density,
            pressure=self.fluid.pressure(density),
            coordinates=state.coordinates,
        )
