"""The viscosity of a Taylor-Green vortex from noisy velocities at probes."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import optax

from jaxsph.arrangements import JitteredLattice
from jaxsph.effects import LaminarViscosity
from jaxsph.scenes import taylor_green
from jaxsph.schemes import DeltaPlus

from .problem import descend, grid, noisy, probes_of, run

REYNOLDS, FIRST_GUESS = 100.0, 40.0


def solve(
    side: int = 32, end_time: float = 0.5, probes: int = 8, noise: float = 0.01, steps: int = 8
) -> dict[str, Any]:
    """L-BFGS on log nu; data of a run with other particles, noise relative to its largest."""
    scenes = [
        taylor_green(
            side, reynolds, end_time=end_time, arrangement=JitteredLattice(seed=seed),
            scheme=DeltaPlus(),
        )
        for seed, reynolds in enumerate((REYNOLDS, FIRST_GUESS))
    ]
    measure = probes_of(grid(scenes[0].space, probes), scenes[0].space)
    truth, _ = jax.jit(lambda m: run(scenes[0], m))(scenes[0].model())
    data = noisy(measure(truth), noise)
    model = scenes[1].model()

    def loss(logarithm):
        found, code = run(scenes[1], model.with_effect(LaminarViscosity(jnp.exp(logarithm))))
        return jnp.mean((measure(found) - data) ** 2), code

    start = jnp.log(jnp.asarray(1.0 / FIRST_GUESS))
    descent = descend(loss, start, optax.lbfgs(), steps, "viscosity")
    errors = [abs(float(jnp.exp(p)) * REYNOLDS - 1.0) for p in descent.history]
    return {
        "particles": scenes[0].state.density.shape[0],
        "probes": probes**2,
        "noise": noise,
        "steps": steps,
        "viscosity": float(jnp.exp(descent.history[-1])),
        "true_viscosity": 1.0 / REYNOLDS,
        "errors_percent": [100.0 * e for e in errors],
        "error_percent": 100.0 * errors[-1],
        "losses": descent.losses,
        "gradient_evaluations": descent.evaluations,
        "seconds": descent.seconds,
        "compile_seconds": descent.compile_seconds,
    }
