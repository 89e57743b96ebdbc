"""The velocity field that a flow started from, from what it had become."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax

from jaxsph.arrangements import JitteredLattice
from jaxsph.scenes import taylor_green
from jaxsph.schemes import DeltaPlus

from .problem import descend, grid, probes_of, run


def solve(
    side: int = 24, end_time: float = 0.1, probes: int = 24, steps: int = 40
) -> dict[str, Any]:
    """L-BFGS on every particle's velocity, from rest; data on a grid, as of image velocimetry."""
    start = JitteredLattice(seed=1)
    scene = taylor_green(side, 100.0, end_time=end_time, arrangement=start, scheme=DeltaPlus())
    measure = probes_of(grid(scene.space, probes), scene.space)
    model = scene.model()
    truth, _ = jax.jit(lambda m: run(scene, m))(model)
    data = measure(truth)

    def loss(velocity):
        state = eqx.tree_at(lambda s: s.velocity, scene.state, velocity)
        found, code = run(scene, model, state)
        return jnp.mean((measure(found) - data) ** 2), code

    start = jnp.zeros_like(scene.state.velocity)
    descent = descend(loss, start, optax.lbfgs(), steps, "initial field")
    true = np.asarray(scene.state.velocity)
    error = np.linalg.norm(np.asarray(descent.best) - true) / np.linalg.norm(true)
    return {
        "particles": len(true),
        "unknowns": true.size,
        "probes": probes**2,
        "steps": steps,
        "loss_reduced_by": descent.losses[0] / min(descent.losses),
        "field_error_percent": 100.0 * float(error),
        "losses": descent.losses,
        "gradient_evaluations": descent.evaluations,
        "seconds": descent.seconds,
        "compile_seconds": descent.compile_seconds,
    }
