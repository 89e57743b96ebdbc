"""PySPH's side: its own compiled equations, neighbour search and integrator, in its own Python.

See `benchmarks.peers.setup`. Always in double precision, on the threads that OMP_NUM_THREADS says.
"""

from __future__ import annotations

import platform
import sys
from importlib.metadata import version

import numpy as np
from compyle.config import get_config
from pysph.base.kernels import WendlandQuintic
from pysph.base.nnps import DomainManager, LinkedListNNPS
from pysph.base.utils import get_particle_array
from pysph.sph.basic_equations import ContinuityEquation
from pysph.sph.equation import Equation, Group
from pysph.sph.scheme import TVFScheme, WCSPHScheme
from pysph.sph.wc.basic import MomentumEquation, TaitEOS
from pysph.sph.wc.viscosity import LaminarViscosity

from .protocol import PLAIN, RICHEST, TRANSPORT, Case, Side, serve

FLUID = "fluid"
TERMS = {
    PLAIN: (
        "ContinuityEquation",
        "MomentumEquation: p_i/rho_i^2 + p_j/rho_j^2, its artificial viscosity with alpha = beta "
        "= 0, p = c0^2 (rho - rho0)",
        "LaminarViscosity: of each component (Morris form)",
    ),
    RICHEST: (
        "WCSPHScheme(delta_sph=True): ContinuityEquation",
        "ContinuityEquationDeltaSPH with renormalised gradients, delta = 0.1",
        "MomentumEquation as in the plain scheme",
        "MomentumEquationDeltaSPH: artificial viscosity, computed with alpha = 0",
        "LaminarViscosityDeltaSPH: Monaghan and Gingold, 2(n+2) nu",
        "XSPHCorrection of dx/dt",
    ),
    TRANSPORT: (
        "TVFScheme: density by summation",
        "pressure gradient and background pressure",
        "viscosity of each component",
        "artificial stress of the transport velocity",
    ),
}


class MoveWithVelocity(Equation):
    """dx/dt = u, which PySPH's steppers otherwise have of its XSPH correction."""

    def initialize(self, d_idx, d_ax, d_ay, d_az, d_u, d_v, d_w):
        d_ax[d_idx] = d_u[d_idx]
        d_ay[d_idx] = d_v[d_idx]
        d_az[d_idx] = d_w[d_idx]


class PySph(Side):
    """Equations compiled by PySPH's own solver object, which also steps in time.

    Args:
        cache: whether a step's loops after the first reuse the neighbours that it found, at the
            price of memory; PySPH's own default is that every loop finds them in the cells.
    """

    def __init__(self, cache: bool):
        self._cache = cache

    def versions(self):
        names = ("pysph", "compyle", "cython", "numpy")
        found = {name: version(name) for name in names}
        return found | {"python": platform.python_version()}

    def setup(self, case: Case):
        self._case = case
        h = case.smoothing_length
        limits = (
            0.25 * h / (case.sound_speed + case.speed),
            0.125 * h**2 / case.viscosity,
        )
        self._steps, self._dt = case.steps_per_slice(min(limits))
        self._build(case)
        return {
            "terms": list(TERMS[case.scheme]),
            "neighbor_search": "linked cells, sorted anew in every step; a right-hand side "
            + (
                "loops over neighbours kept from the search"
                if self._cache
                else "finds the neighbours in them, once in every loop over pairs (PySPH's default)"
            ),
            "integrator": "predict, evaluate, correct",
            "right_hand_sides_per_step": 1,
            "time_step_rule": "its Taylor-Green example's: min(0.25 h / (c0 + U), 0.125 h^2 / nu)",
        }

    def _build(self, case: Case):
        scheme = _scheme(case)
        kernel = WendlandQuintic(dim=2)
        self._particles = _particles(case)
        scheme.setup_properties([self._particles])
        if case.scheme == TRANSPORT:
            self._particles.V[:] = 1.0 / case.spacing**2
        scheme.configure_solver(kernel=kernel, dt=self._dt, tf=case.end_time)
        self._solver = scheme.get_solver()
        self._solver.set_parallel_manager(None)
        domain = DomainManager(
            xmin=0.0, xmax=1.0, ymin=0.0, ymax=1.0, periodic_in_x=True, periodic_in_y=True
        )
        self._nnps = LinkedListNNPS(
            dim=2,
            particles=[self._particles],
            radius_scale=kernel.radius_scale,
            domain=domain,
            fixed_h=True,
            cache=self._cache,
        )
        equations = _plain(case) if case.scheme == PLAIN else scheme.get_equations()
        self._solver.setup([self._particles], equations, self._nnps, kernel, fixed_h=True)
        self._evaluate = self._solver.acceleration_evals[0].compute
        self._time = 0.0

    def evaluate(self):
        self._evaluate(0.0, self._dt)

    def search(self):
        self._nnps.update_domain()
        self._nnps.update()
        if self._cache:
            self._nnps.cache[0].find_all_neighbors()

    def derivative(self):
        real = slice(len(self._case.position))
        array = self._particles
        acceleration = np.stack([array.au[real], array.av[real]], axis=1)
        rate = array.arho[real] if self._case.scheme != TRANSPORT else np.zeros(len(acceleration))
        return acceleration, rate

    def prepare_run(self):
        self._solver.integrator.initial_acceleration(0.0, self._dt)
        return self._steps, self._dt

    def run_slice(self):
        for _ in range(self._steps):
            self._solver.integrator.step(self._time, self._dt)
            self._time += self._dt
        return None if np.isfinite(self.fields()[1]).all() else "NOT_FINITE"

    def fields(self):
        real, array = slice(len(self._case.position)), self._particles
        position = np.stack([array.x[real], array.y[real]], axis=1)
        return position, np.stack([array.u[real], array.v[real]], axis=1), array.p[real].copy()


def _scheme(case: Case):
    common = {"dim": 2, "rho0": case.reference_density, "c0": case.sound_speed}
    common |= {"nu": case.viscosity, "h0": case.smoothing_length}
    if case.scheme == TRANSPORT:
        background = case.reference_density * case.sound_speed**2
        return TVFScheme([FLUID], [], p0=background, pb=background, **common)
    return WCSPHScheme(
        [FLUID], [], hdx=case.h_over_dx, gamma=1.0, alpha=0.0, beta=0.0, delta=0.1,
        delta_sph=case.scheme == RICHEST, **common,
    )  # fmt: skip


def _plain(case: Case):
    both = {"dest": FLUID, "sources": [FLUID]}
    state = TaitEOS(FLUID, None, rho0=case.reference_density, c0=case.sound_speed, gamma=1.0)
    return [
        Group([state], real=False),
        Group([
            ContinuityEquation(**both),
            MomentumEquation(**both, c0=case.sound_speed, alpha=0.0, beta=0.0),
            LaminarViscosity(**both, nu=case.viscosity),
            MoveWithVelocity(FLUID, None),
        ]),
    ]  # fmt: skip


def _particles(case: Case):
    (x, y), (u, v) = case.position.T.copy(), case.velocity.T.copy()
    pressure = case.sound_speed**2 * (case.density - case.reference_density)
    return get_particle_array(
        name=FLUID, x=x, y=y, u=u, v=v, rho=case.density, p=pressure, m=case.mass,
        h=case.smoothing_length,
    )  # fmt: skip


if __name__ == "__main__":
    get_config().use_openmp = True
    serve(PySph(cache="cache" in sys.argv[1:]))
