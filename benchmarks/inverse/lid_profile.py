"""The motion of a lid that gives a wanted velocity on a cavity's centre line."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax

from jaxsph.metrics import centre_line
from jaxsph.scenes import lid_driven_cavity
from jaxsph.schemes import DeltaPlus

from .problem import descend, probes_of, run

_ROUGHNESS = 1e-4  # weight of the profile's second differences: a line does not fix a profile


def solve(side: int = 20, end_time: float = 1.0, knots: int = 9, steps: int = 15) -> dict[str, Any]:
    """L-BFGS on the lid's speed at knots, linear in between and zero at its ends.

    What is wanted are both velocities on the vertical centre line, in the last half of the run,
    under the paper's lid; the first guess is a lid at half its speed, the same everywhere.
    """
    scene = lid_driven_cavity(side, 100.0, end_time=end_time, scheme=DeltaPlus())
    measure = probes_of(centre_line(scene.space), scene.space)
    model = scene.model()
    walls = model.functional.walls
    x = walls.position[:, 0]
    above = (walls.position[:, 1] > 1.0) & (x > 0.0) & (x < 1.0)
    at = jnp.linspace(0.0, 1.0, knots + 2)

    def driven(speeds):
        profile = jnp.interp(x, at, jnp.pad(speeds, 1))
        along = jnp.where(above, profile, 0.0)
        velocity = jnp.stack([along, jnp.zeros_like(along)], axis=1)
        return eqx.tree_at(lambda m: m.functional.walls.velocity, model, velocity)

    def line(model):
        snapshots, code = run(scene, model)
        late = jax.tree.map(lambda a: a[a.shape[0] // 2 :], snapshots)
        return measure(late), code

    wanted, _ = jax.jit(line)(model)

    def loss(speeds):
        found, code = line(driven(speeds))
        rough = jnp.mean(jnp.diff(jnp.pad(speeds, 1), 2) ** 2)
        return jnp.mean((found - wanted) ** 2) / jnp.mean(wanted**2) + _ROUGHNESS * rough, code

    start = jnp.full(knots, 0.5)
    descent = descend(loss, start, optax.lbfgs(), steps, "lid profile")
    shown = jax.jit(lambda speeds: line(driven(speeds))[0])

    def apart(speeds):
        off = np.asarray(shown(speeds) - wanted)[-1]
        return 100.0 * float(np.abs(off).max() / np.abs(np.asarray(wanted)[-1]).max())

    return {
        "particles": scene.state.density.shape[0],
        "knots": knots,
        "steps": steps,
        "line_error_at_start_percent": apart(start),
        "line_error_percent": apart(descent.best),
        "profile": np.asarray(descent.best).tolist(),
        "true_profile": np.asarray(jnp.interp(at[1:-1], *_lid(walls, above))).tolist(),
        "losses": descent.losses,
        "gradient_evaluations": descent.evaluations,
        "seconds": descent.seconds,
        "compile_seconds": descent.compile_seconds,
    }


def _lid(walls, above):
    """Places and speeds of the true lid, in order."""
    x, speed = (
        np.asarray(a)[np.asarray(above)] for a in (walls.position[:, 0], walls.velocity[:, 0])
    )
    order = np.argsort(x, kind="stable")
    return jnp.asarray(x[order]), jnp.asarray(speed[order])
