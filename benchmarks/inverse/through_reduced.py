"""The viscosity through a reduced model in milliseconds, verified on the full model."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
import numpy as np
import optax

from jaxsph import run_scene
from jaxsph.arrangements import Stirred
from jaxsph.scenes import balanced, taylor_green
from jaxsph.schemes import DeltaPlus
from jaxsph_rom.points import Family, LinearClosure, train

from .problem import descend, noisy

TRAINED_ON = (60.0, 100.0, 150.0, 200.0)
REYNOLDS, FIRST_GUESS = 120.0, 70.0


def solve(
    side: int = 32, modes: int = 5, end_time: float = 0.5, noise: float = 0.01, steps: int = 10,
    iterations: int = 300, every: int = 16,
) -> dict[str, Any]:  # fmt: skip
    """L-BFGS on log nu of the tensors; data are a full run's, at some of the reference points.

    The full run at what was found is put beside the data's own run: that is the verification.
    """

    def make(reynolds):
        return balanced(
            taylor_green(
                side, reynolds, end_time=end_time, arrangement=Stirred(seed=0), scheme=DeltaPlus()
            )
        )

    closure = LinearClosure(iterations=iterations)
    parameters = [{"reynolds": reynolds} for reynolds in TRAINED_ON]
    trained = train(Family(make, starts=False), parameters, modes, closure=closure)
    flow = trained.flow
    truth = make(REYNOLDS)
    observed = _velocities(flow, run_scene(truth), every)
    data = noisy(observed, noise)
    places = np.arange(0, len(flow.reference.points), every)
    centre = np.broadcast_to(
        flow.basis.centre, (len(flow.reference.points), *flow.basis.centre.shape[1:])
    )
    shapes, base = jnp.asarray(flow.basis.modes[places, 1:]), jnp.asarray(centre[places, 1:])

    def loss(logarithm):
        viscosity = jnp.exp(logarithm)
        found = trained.predict({"reynolds": 1.0 / viscosity}).coordinates[0, 1:]
        velocity = base[None] + jnp.einsum("pdm,sm->spd", shapes, found)
        return jnp.mean((velocity - data) ** 2), jnp.zeros((), jnp.int32)

    start = jnp.log(jnp.asarray(1.0 / FIRST_GUESS))
    descent = descend(loss, start, optax.lbfgs(), steps, "reduced")
    found = float(jnp.exp(descent.best))
    verified = run_scene(make(1.0 / found))
    apart = _velocities(flow, verified, every) - observed
    return {
        "particles": truth.state.density.shape[0],
        "modes": modes,
        "trained_on": list(TRAINED_ON),
        "noise": noise,
        "steps": steps,
        "reynolds": 1.0 / found,
        "true_reynolds": REYNOLDS,
        "error_percent": 100.0 * abs(found * REYNOLDS - 1.0),
        "verified_velocity_error_percent": 100.0
        * float(np.abs(apart).max() / np.abs(observed).max()),
        "seconds": descent.seconds,
        "compile_seconds": descent.compile_seconds,
        "full_run_seconds": verified.timing.run_seconds,
        "offline_seconds": trained.training["offline_seconds"]
        + trained.training["closure_seconds"]
        + trained.training["full_seconds"],
        "losses": descent.losses,
        "gradient_evaluations": descent.evaluations,
    }


def _velocities(flow, trajectory, every: int) -> np.ndarray:
    """Velocities (S, P, n) of a full run at every so many reference points, without the start."""
    return np.moveaxis(flow.reference.snapshots(trajectory)[::every, 1:, 1:], 2, 0)
