"""JAX-SPH's side: its own solver, neighbour list and integrator, in its own Python.

Its sources are on the path; see `benchmarks.peers.setup`.
"""

from __future__ import annotations

import platform
import subprocess
from functools import partial
from importlib.metadata import version
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jax_sph import partition
from jax_sph.eos import TaitEoS
from jax_sph.integrator import si_euler
from jax_sph.jax_md import space
from jax_sph.jax_md.partition import Sparse
from jax_sph.solver import WCSPH
from jax_sph.utils import Tag

from .protocol import PLAIN, RICHEST, TRANSPORT, Case, Side, serve

# solver, density evolution, factor of the transport velocity
SETTINGS = {
    PLAIN: ("SPH", True, 0.0),
    RICHEST: ("DELTA", True, 0.0),
    TRANSPORT: ("SPH", False, 1.0),
}
_COMMON = (
    "pressure force with p_ij = (rho_j p_i + rho_i p_j) / (rho_i + rho_j), p = c0^2 (rho - rho0)",
    "viscosity of each component (Morris form, harmonic mean)",
    "in every scheme: stress of the transport velocity (zero where it is off)",
    "in every scheme: background-pressure acceleration of the transport velocity",
)
TERMS = {
    PLAIN: ("continuity", *_COMMON),
    RICHEST: (
        "continuity",
        "delta-SPH diffusion of density with renormalised gradients, delta = 0.1",
        "delta-SPH artificial viscosity, computed with alpha = 0",
        *_COMMON,
    ),
    TRANSPORT: ("density by summation", *_COMMON),
}
_CFL = 0.25  # JAX-SPH's default


class JaxSph(Side):
    """`WCSPH.forward` and `si_euler` as JAX-SPH's own `simulate` puts them together."""

    def versions(self):
        names = ("jax", "jaxlib", "numpy")
        found = {name: version(name) for name in names} | {"python": platform.python_version()}
        return found | {"jax-sph": _commit()}

    def setup(self, case: Case):
        self._case = case
        displacement, shift = space.periodic(side=np.ones(2))
        dx, nu = case.spacing, case.viscosity
        limits = (dx / (case.sound_speed + case.speed), dx**2 / nu)
        self._steps, self._dt = case.steps_per_slice(_CFL * min(limits))
        solver_name, evolved, transport = SETTINGS[case.scheme]
        rho0 = case.reference_density
        solver = WCSPH(
            displacement,
            TaitEoS(rho0 * case.sound_speed**2, rho0, 0.0, 1.0),
            jnp.zeros_like,
            dx,
            2,
            self._dt,
            case.sound_speed,
            diff_delta=0.1,
            diff_alpha=0.0,
            solver=solver_name,
            kernel="WC2K",
            h_fac=case.h_over_dx,
            is_rho_evol=evolved,
        )
        self._lists = partition.neighbor_list(
            displacement,
            np.ones(2),
            r_cutoff=2.0 * case.smoothing_length,
            backend="jaxmd_vmap",
            capacity_multiplier=1.25,
            mask_self=False,
            format=Sparse,
            num_particles_max=len(case.position),
            num_partitions=1,
            pbc=np.ones(3, bool),
        )
        self._start = _state(case)
        self._moved = self._start["r"] + 1e-9 * dx  # where nothing moved it would not search
        self._found = self._lists.allocate(self._start["r"], num_particles=len(case.position))
        forward = solver.forward_wrapper()
        self._forward = jax.jit(forward)
        self._update = jax.jit(lambda n, r: n.update(r, num_particles=len(case.position)))
        self._advance = jax.jit(si_euler(transport, forward, shift, lambda state: state, None))
        return {
            "terms": list(TERMS[case.scheme]),
            "neighbor_search": "list of pairs without a skin, found anew in every step; a "
            f"right-hand side loops over {self._found.idx.shape[1]} slots",
            "integrator": "semi-implicit Euler",
            "right_hand_sides_per_step": 1,
            "time_step_rule": "its default: 0.25 min(dx / (c0 + U), dx^2 / nu)",
        }

    def evaluate(self):
        jax.block_until_ready(self._forward(self._start, self._found))

    def search(self):
        jax.block_until_ready(self._update(self._found, self._moved))

    def derivative(self):
        state = self._forward(self._start, self._found)
        return np.asarray(state["dudt"]), np.asarray(state["drhodt"])

    def prepare_run(self):
        # as in its `simulate`: the first call, with dt = 0, compiles and makes accelerations
        self._state, self._neighbors = self._start, self._found
        jax.block_until_ready(self._advance(0.0, self._state, self._neighbors))
        return self._steps, self._dt

    def run_slice(self):
        for _ in range(self._steps):
            state, neighbors = self._advance(self._dt, self._state, self._neighbors)
            if neighbors.did_buffer_overflow:
                count = len(self._case.position)
                self._neighbors = self._lists.allocate(self._state["r"], num_particles=count)
                state, neighbors = self._advance(self._dt, self._state, self._neighbors)
            self._state, self._neighbors = state, neighbors
        velocity = np.asarray(self._state["u"])
        return None if np.isfinite(velocity).all() else "NOT_FINITE"

    def fields(self):
        return tuple(np.asarray(self._state[name]) for name in ("r", "u", "p"))


def _commit() -> str:
    """The commit of JAX-SPH's sources, as the version in them stays the same."""
    folder = Path(partition.__file__).parent
    command = ["git", "-C", str(folder), "rev-parse", "HEAD"]
    try:
        found = subprocess.run(command, capture_output=True, text=True)
    except FileNotFoundError:
        return "unknown"
    return found.stdout.strip() or "unknown"


def _state(case: Case):
    """JAX-SPH's dictionary of sixteen fields, as its `SimulationSetup` fills it."""
    velocity, density = jnp.asarray(case.velocity), jnp.asarray(case.density)
    ones, none = jnp.ones_like(density), partial(jnp.zeros_like, velocity)
    return {
        "r": jnp.asarray(case.position),
        "tag": jnp.full(len(ones), Tag.FLUID, dtype=int),
        "u": velocity,
        "v": velocity,
        "dudt": none(),
        "dvdt": none(),
        "drhodt": 0.0 * ones,
        "rho": density,
        "p": case.sound_speed**2 * (density - case.reference_density),
        "mass": case.mass * ones,
        "eta": case.viscosity * case.reference_density * ones,
        "dTdt": 0.0 * ones,
        "T": ones,
        "kappa": 0.0 * ones,
        "Cp": 0.0 * ones,
        "nw": none(),
    }


if __name__ == "__main__":
    jax.config.update("jax_enable_x64", True)
    serve(JaxSph())
