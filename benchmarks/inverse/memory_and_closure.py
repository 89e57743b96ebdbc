"""Memory length and closure of reduced models, learnt through their own trajectories."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax

from jaxsph import run_scene
from jaxsph.arrangements import Lattice
from jaxsph.integrate import integrate
from jaxsph.scenes import taylor_green
from jaxsph.schemes import DeltaPlus
from jaxsph_rom import (
    AdjointPetrovGalerkin,
    ConsistentAdvection,
    Energy,
    LatticePolynomials,
    ReducedModel,
    ReducedState,
    ReferenceSpace,
    pod,
)
from jaxsph_rom.points import LinearClosure, train

from .problem import descend

_FIRST_TAU = 1e-4  # s


def solve(
    side: int = 24, modes: int = 5, end_time: float = 0.3, steps: int = 30, iterations: int = 300
) -> dict[str, Any]:
    """Adam on log tau on moving particles; and the linear closure of the tensors.

    The loss of tau is the energy of the error of the coordinates over that of the coordinates, in
    the run that the basis is of.
    """

    def make(reynolds):
        given = {"arrangement": Lattice(), "scheme": DeltaPlus()}
        return taylor_green(side, reynolds, end_time=end_time, **given)

    parameters = [{"reynolds": 100.0}, {"reynolds": 200.0}]
    scenes = [make(**named) for named in parameters]
    runs = [run_scene(scene) for scene in scenes]
    return {"tau": _memory(scenes[0], runs[0], modes, steps)} | {
        "closure": _closure(make, parameters, runs, modes, iterations)
    }


def _memory(scene, trajectory, modes: int, steps: int) -> dict[str, Any]:
    points = scene.state.position
    basis = pod(
        ReferenceSpace(points, scene.space).snapshots(trajectory), Energy(), scene.fluid, modes
    )
    interpolation = LatticePolynomials.fit(
        np.asarray(points), basis.functions.reshape(len(points), -1), scene.space, 3
    )
    tau = AdjointPetrovGalerkin(jnp.asarray(_FIRST_TAU))
    model = ReducedModel.of_scene(scene, basis, interpolation, tau, ConsistentAdvection())
    project = jax.jit(lambda state: model.project(state).coordinates)
    wanted = jnp.stack([project(trajectory.state(k)) for k in range(len(trajectory.time))])
    start = ReducedState(wanted[0], points)

    def loss(logarithm):
        ours = eqx.tree_at(lambda m: m.projection.tau, model, jnp.exp(logarithm))
        _, fault, found, _ = integrate(
            ours, start, jnp.zeros((), jnp.int32), jnp.asarray(scene.time_step),
            scene.steps_per_snapshot, len(wanted) - 1,
        )  # fmt: skip
        return jnp.sum((found.coordinates - wanted[1:]) ** 2) / jnp.sum(wanted[1:] ** 2), fault.code

    optimiser = optax.adam(optax.cosine_decay_schedule(0.4, steps))
    descent = descend(loss, jnp.log(jnp.asarray(_FIRST_TAU)), optimiser, steps, "memory length")
    return {
        "particles": len(points),
        "modes": modes,
        "steps": steps,
        "first_tau": _FIRST_TAU,
        "tau": float(jnp.exp(descent.best)),
        "time_step": scene.time_step,
        "losses": descent.losses,
        "gradient_evaluations": descent.evaluations,
        "loss_reduced_by": descent.losses[0] / min(descent.losses),
        "seconds": descent.seconds,
        "compile_seconds": descent.compile_seconds,
    }


def _closure(make, parameters, runs, modes: int, iterations: int) -> dict[str, Any]:
    window = min(50, len(runs[0].time) - 1)
    learnt = LinearClosure(window=window, iterations=iterations)
    made = {
        name: train(make, parameters, modes, runs=runs, closure=closure).training
        for name, closure in (("none", None), ("linear", learnt))
    }
    return {
        "modes": modes,
        "iterations": iterations,
        "seconds": made["linear"]["closure_seconds"],
        "floor": _by_reynolds(made["none"], "floor"),
        "without": _by_reynolds(made["none"], "errors"),
        "with": _by_reynolds(made["linear"], "errors"),
    }


def _by_reynolds(training: dict[str, Any], kind: str) -> dict[str, Any]:
    return {f"{run['parameters']['reynolds']:g}": run[kind] for run in training["runs"]}
