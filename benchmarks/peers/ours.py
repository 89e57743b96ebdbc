"""This library's side: the full model as a user runs it."""

from __future__ import annotations

import dataclasses
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxsph import COMPILER_OPTIONS, ParticleState
from jaxsph.arrangements import Lattice
from jaxsph.effects import Continuity, IsotropicViscosity, PressureForce
from jaxsph.environment import versions
from jaxsph.integrate import FaultCode, integrate
from jaxsph.scenes import taylor_green
from jaxsph.schemes import DeltaPlus

from .protocol import PLAIN, Case, Side, serve

TERMS = {
    "Continuity": "drho/dt = -rho sum (u_j - u_i).grad W V_j",
    "PressureForce": "-(p_i + p_j) grad W V_j / rho_i, p = c0^2 (rho - rho0)",
    "IsotropicViscosity": "viscosity of each component (Morris et al. 1997)",
    "LaminarViscosity": "viscosity of Monaghan and Gingold, 2(n+2) nu",
    "DensityDiffusion": "delta-SPH diffusion with renormalised gradients, delta = 0.1",
    "ParticleShifting": "shift velocity in dx/dt",
    "ShiftingTransport": "its terms in continuity (two sums) and momentum (one)",
}


class Ours(Side):
    """The scene `taylor-green`, its particles and effects exchanged for the case's."""

    def versions(self):
        return versions()

    def setup(self, case: Case):
        self._case, self._scene = case, _scene(case)
        self._model = self._scene.model()
        state = self._scene.state
        functional = self._scene.functional()
        time = jnp.zeros((), state.density.dtype)
        build = jax.jit(self._model.search.build).lower(state.position).compile(COMPILER_OPTIONS)
        self._build = partial(build, state.position)
        neighbors = self._build()
        if bool(neighbors.overflow):
            raise ValueError("the neighbour list overflows.")
        arguments = (functional, state, neighbors)
        lowered = jax.jit(lambda f, y, n: f(time, y, n)).lower(*arguments)
        self._call = partial(lowered.compile(COMPILER_OPTIONS), *arguments)
        return {
            "terms": [f"{e.name}: {TERMS[e.name]}" for e in self._scene.effects],
            "neighbor_search": "list with a Verlet skin, kept over steps; a right-hand side loops "
            f"over {self._model.search.capacity} slots a particle",
            "integrator": "RK4",
            "right_hand_sides_per_step": 4,
            "time_step_rule": "the scene's: 0.16 dx / U",
        }

    def evaluate(self):
        jax.block_until_ready(self._call())

    def search(self):
        jax.block_until_ready(self._build())

    def derivative(self):
        rates = self._call()
        return np.asarray(rates.velocity), np.asarray(rates.density)

    def prepare_run(self):
        steps, dt = self._case.steps_per_slice(self._scene.time_step)
        self._dt, self._steps = jnp.asarray(dt, self._scene.state.density.dtype), steps
        self._compile_run()
        while self._rehearsed() == FaultCode.NEIGHBOR_OVERFLOW.name and self._model.enlarged():
            self._model = self._model.enlarged()  # `simulate` does the same in the middle of a run
            self._compile_run()
        self._state, self._step = self._scene.state, 0
        return steps, dt

    def _compile_run(self):
        self._state, self._step = self._scene.state, 0
        run = partial(integrate, steps_per_snapshot=self._steps, snapshots=1)
        run = eqx.filter_jit(run, compiler_options=COMPILER_OPTIONS)
        self._integrate = run.lower(self._model, self._state, np.int32(0), self._dt).compile()

    def _rehearsed(self):
        """The first fault's name of a whole run, or None: what room its lists need."""
        return next(filter(None, (self.run_slice() for _ in range(self._case.slices))), None)

    def run_slice(self):
        self._state, fault, _, _ = jax.block_until_ready(
            self._integrate(self._model, self._state, np.int32(self._step), self._dt)
        )
        self._step += self._steps
        code = FaultCode(int(fault.code))
        return None if code == FaultCode.NONE else code.name

    def fields(self):
        pressure = self._scene.fluid.pressure(self._state.density)
        return tuple(map(np.asarray, (self._state.position, self._state.velocity, pressure)))


def _scene(case: Case):
    scene = taylor_green(
        case.resolution,
        case.reynolds,
        h_over_dx=case.h_over_dx,
        end_time=case.end_time,
        arrangement=Lattice(),
        scheme=DeltaPlus(),
        mach=case.mach,
    )
    state = ParticleState(*map(jnp.asarray, (case.position, case.velocity, case.density)))
    effects = scene.effects
    if case.scheme == PLAIN:
        viscosity = jnp.asarray(case.viscosity, state.density.dtype)
        effects = (Continuity(), PressureForce(), IsotropicViscosity(viscosity))
    return dataclasses.replace(scene, state=state, effects=effects)


if __name__ == "__main__":
    with jax.enable_x64(True):
        serve(Ours())
