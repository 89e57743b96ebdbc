"""What can go wrong inside a compiled loop, carried as a code and raised once at its end."""

from __future__ import annotations

from enum import IntEnum

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Int


class FaultCode(IntEnum):
    """Result of a step; 0 is a good one."""

    NONE = 0
    NOT_FINITE = 1
    DENSITY_OUT_OF_BOUNDS = 2
    NEIGHBOR_OVERFLOW = 3
    NEIGHBORS_OUTDATED = 4
    SPLINE_CELL_OVERFLOW = 5
    BEYOND_WALL = 6
    ENERGY_OUT_OF_BOUNDS = 7
    STEPS_EXHAUSTED = 8
    CLUMPED = 9
    BODY_MET_WALL = 10
    NONE_PARKED = 11


# what it means, and what to do where nothing more is known
_EXPLANATIONS = {
    FaultCode.NOT_FINITE: (
        "a value is not finite any more (NaN or infinity)",
        "use a smaller time step or a higher viscosity",
    ),
    FaultCode.DENSITY_OUT_OF_BOUNDS: (
        "a density left its bounds, so the flow is no longer weakly compressible",
        "use a smaller time step or a higher sound speed",
    ),
    FaultCode.NEIGHBOR_OVERFLOW: (
        "a particle has more neighbours than the list holds: particles have clumped",
        "resume from the last snapshot (which allocates anew) with a larger margin",
    ),
    FaultCode.NEIGHBORS_OUTDATED: (
        "a particle moved more than half the neighbour list's skin in one step",
        "use a smaller time step",
    ),
    FaultCode.SPLINE_CELL_OVERFLOW: (
        "a cell of the reference splines holds more particles than allocated: particles have "
        "clumped",
        "allocate with a larger margin",
    ),
    FaultCode.BEYOND_WALL: (
        "a particle went through a wall",
        "use a smaller time step or a higher resolution",
    ),
    FaultCode.ENERGY_OUT_OF_BOUNDS: (
        "the flow has more energy than its reference speed allows, so the reduced model has left "
        "the flows that it knows",
        "use other modes, a closure, or a parameter nearer to those trained on",
    ),
    FaultCode.STEPS_EXHAUSTED: (
        "the automatic steps became so short that an interval did not end",
        "allow more of them, or look at what moves so fast in the last snapshot",
    ),
    FaultCode.CLUMPED: (
        "particles have clumped: two are nearer to one another than a tenth of their spacing",
        "use the consistent scheme, the modes' own advection, a map that keeps quadratic fields or "
        "other modes",
    ),
    FaultCode.BODY_MET_WALL: (
        "a free body met a wall or another body, and contact is not modelled",
        "end the run before, or leave more room around the body",
    ),
    FaultCode.NONE_PARKED: (
        "more particles come in through the openings than are parked",
        "park more of them at the start, or end the run before",
    ),
}


class Fault(eqx.Module):
    """A fault's code, the step that met it and the particle at which it shows (-1: all)."""

    code: Int[Array, ""]
    step: Int[Array, ""]
    particle: Int[Array, ""]

    @classmethod
    def none(cls) -> Fault:
        return cls(*(jnp.asarray(k, jnp.int32) for k in (FaultCode.NONE, -1, -1)))

    @classmethod
    def first_of(cls, step, *checks) -> Fault:
        """The first check that fails, of triples (code, failed, particle)."""
        code, where = jnp.asarray(0, jnp.int32), jnp.asarray(-1, jnp.int32)
        for number, failed, particle in reversed(checks):
            code = jnp.where(failed, jnp.asarray(int(number), jnp.int32), code)
            where = jnp.where(failed, jnp.asarray(particle, jnp.int32), where)
        return cls(code, jnp.where(code == 0, -1, step).astype(jnp.int32), where)


def explanation(code: int, likely: str | None = None) -> str:
    """What a fault code means, and what is likely or, where that is not known, what to do."""
    meaning, remedy = _EXPLANATIONS[FaultCode(code)]
    return f"{meaning}; {likely or remedy}"


class SimulationError(RuntimeError):
    """A run met a fault; names the step, its time and the particle.

    `trajectory` holds the good snapshots, where `simulate` raised it.

    Args:
        fault: as the loop returned it.
        time_step: dt [s].
        likely: what it most likely comes from and what to do, if that is known.
    """

    trajectory = None

    def __init__(self, fault: Fault, time_step: float, likely: str | None = None):
        self.code = FaultCode(int(fault.code))
        self.step, self.particle = int(fault.step), int(fault.particle)
        where = f", particle {self.particle}" if self.particle >= 0 else ""
        super().__init__(
            f"step {self.step} (t = {self.step * time_step:.6g} s{where}): "
            f"{explanation(self.code, likely)}."
        )
