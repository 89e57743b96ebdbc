"""Reduced systems by diffrax: steps as long as a tolerance allows, explicit or implicit."""

from __future__ import annotations

from typing import Self

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from jaxsph.integrate.diffrax_term import ode_term

from .base import Dynamics
from .points_model import PointsModel


class SolverError(RuntimeError):
    """A solver of diffrax gave up, or what it found is not finite."""


class AdaptiveRun(eqx.Module):
    """Coordinates at the times asked for, and what the solver did for them.

    Args:
        coordinates: infinite from where the solver gave up.
        steps: tried, rejected ones included.
        rejected: of these.
        result: as diffrax says it.
    """

    coordinates: Float[Array, "*runs times modes"]
    steps: Int[Array, "*runs"]
    rejected: Int[Array, "*runs"]
    result: diffrax.RESULTS

    @property
    def good(self) -> Bool[Array, "*runs"]:
        """Whether the solver came to the end and all that it found is finite."""
        finite = jnp.all(jnp.isfinite(self.coordinates), axis=(-2, -1))
        return (self.result == diffrax.RESULTS.successful) & finite

    def checked(self) -> Self:
        """The run or runs themselves, if all are good; on the host.

        Raises:
            SolverError: if not; it says how far they came and what to do.
        """
        good = np.asarray(self.good)
        if good.all():
            return self
        number = int(np.argmin(good.reshape(-1)))
        where = f"run {number}: " if good.ndim else ""
        finite = np.isfinite(np.asarray(self.coordinates)).all(axis=-1).reshape(good.size, -1)
        raise SolverError(
            f"{where}the solver came to {int(finite[number].sum())} of {finite.shape[1]} times in "
            f"{int(np.asarray(self.steps).reshape(-1)[number])} steps; allow more steps, loosen "
            "the tolerance, or take an implicit solver. What grows beyond all bounds none can "
            "follow."
        )


def solve(
    dynamics: Dynamics,
    coordinates: Float[Array, " modes"],
    values: Float[Array, "*coefficients"],
    times: Float[Array, " times"],
    *,
    solver: diffrax.AbstractSolver | None = None,
    controller: diffrax.AbstractStepSizeController | None = None,
    adjoint: diffrax.AbstractAdjoint | None = None,
    first_step: float | None = None,
    max_steps: int = 4096,
) -> AdaptiveRun:
    """Coordinates of da/dt = f(t, a; theta) at given times, by a solver that chooses its own steps.

    Pure: jit and vmap it over coefficients (all runs then take as many turns as the longest), and
    differentiate it. Snapshots are interpolated between steps and do not shorten them.

    Args:
        dynamics: of the coordinates.
        coordinates: at time 0.
        values: theta, a viscosity say.
        times: increasing, from 0 on [s].
        solver: `diffrax.Tsit5()` if none is given (explicit, fifth order); `diffrax.Kvaerno5()` is
            implicit, for steps beyond the stability limit of sound.
        controller: of the step size; a `diffrax.PIDController` with a tolerance of 1e-6 relative to
            a coordinate, and to the length of the first coordinates as a whole, if none is given.
        adjoint: how it is differentiated; diffrax's checkpointed reverse mode if none is given.
            Forward mode needs `diffrax.ForwardMode()`.
        first_step: [s]; found by diffrax if none is given (a constant step needs one).
        max_steps: after which it gives up.

    Examples:
        >>> import jax.numpy as jnp
        >>> from jaxsph_rom.points import QuadraticSystem
        >>> from jaxsph_rom.points.dynamics.adaptive import solve
        >>> linear = jnp.asarray([[[0.0]], [[-1.0]]])  # da/dt = -nu a
        >>> system = QuadraticSystem(jnp.zeros((2, 1)), linear, jnp.zeros((1, 1, 1)))
        >>> run = solve(system, jnp.ones(1), jnp.asarray(0.5), jnp.asarray([0.0, 2.0])).checked()
        >>> run.coordinates[-1].round(4)  # exp(-1)
        Array([0.3679], dtype=...)
    """
    if controller is None:
        # small modes beside large ones need no relative accuracy of their own
        scale = jax.lax.stop_gradient(jnp.linalg.norm(coordinates))
        controller = diffrax.PIDController(rtol=1e-6, atol=1e-6 * scale)
    times = jnp.asarray(times, coordinates.dtype)
    model = PointsModel(dynamics, jnp.asarray(values, coordinates.dtype))
    # third-party code counts on the usual promotion
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        found = diffrax.diffeqsolve(
            ode_term(model, None),
            diffrax.Tsit5() if solver is None else solver,
            jnp.zeros((), coordinates.dtype),
            times[-1],
            first_step,
            coordinates,
            saveat=diffrax.SaveAt(ts=times),
            stepsize_controller=controller,
            adjoint=diffrax.RecursiveCheckpointAdjoint() if adjoint is None else adjoint,
            max_steps=max_steps,
            throw=False,
        )
    stats = found.stats
    return AdaptiveRun(found.ys, stats["num_steps"], stats["num_rejected_steps"], found.result)
