"""What a side of the comparison offers, and how its process answers: a JSON object a line.

Imports nothing of this repository, so that it runs in every code's own Python.
"""

from __future__ import annotations

import abc
import json
import os
import sys
import time as clock
import traceback
from typing import Any

import numpy as np

REQUESTS = ("load", "right_hand_side", "neighbors", "rates", "prepare", "advance", "state")
PLAIN, RICHEST, TRANSPORT = "plain", "richest", "transport"
SCHEMES = {
    PLAIN: "continuity, pressure and viscosity of each velocity component: all can do it",
    RICHEST: "each code's richest weakly compressible scheme with evolved density",
    TRANSPORT: "the peers' transport-velocity scheme; this library's richest again",
}


class Case:
    """The Taylor-Green vortex in the unit square, as every side gets it.

    Args:
        particles: file of `position` (N, 2) [m], `velocity` [m/s] and `density` [kg/m^3].
        scheme: one of `SCHEMES`.
        resolution: particles per side; dx = 1 / resolution.
        h_over_dx: smoothing length over spacing; the kernel is Wendland C2, support 2 h.
        reynolds: U L / nu with U = 1 m/s and L = 1 m.
        mach: U / c0.
        reference_density: rho0 [kg/m^3].
        end_time: of a run [s].
        slices: in which a run is made, all of as many steps.
    """

    def __init__(
        self, *, particles: str, scheme: str, resolution: int, h_over_dx: float, reynolds: float,
        mach: float, reference_density: float, end_time: float, slices: int,
    ):  # fmt: skip
        with np.load(particles) as arrays:
            self.position, self.velocity = arrays["position"], arrays["velocity"]
            self.density = arrays["density"]
        self.scheme, self.resolution, self.h_over_dx = scheme, resolution, h_over_dx
        self.spacing = 1.0 / resolution
        self.smoothing_length = h_over_dx / resolution
        self.viscosity, self.reynolds = 1.0 / reynolds, reynolds
        self.sound_speed, self.speed = 1.0 / mach, 1.0
        self.mach, self.reference_density = mach, reference_density
        self.mass = reference_density * self.spacing**2
        self.end_time, self.slices = end_time, slices

    def steps_per_slice(self, longest: float) -> tuple[int, float]:
        """Steps of a slice and dt [s], which is at most `longest` [s]."""
        length = self.end_time / self.slices
        steps = max(1, int(np.ceil(length / longest - 1e-9)))
        return steps, length / steps


class Side(abc.ABC):
    """One code. Seconds are per call, compilation apart; `busy` are those of all threads."""

    @abc.abstractmethod
    def versions(self) -> dict[str, str]:
        """Of the code and of what its speed depends on."""

    @abc.abstractmethod
    def setup(self, case: Case) -> dict[str, Any]:
        """Make all ready for a case.

        Returns:
            `terms`, `integrator` and `time_step_rule` in words, `right_hand_sides_per_step`.
        """

    @abc.abstractmethod
    def evaluate(self) -> None:
        """One right-hand side at the start, with the neighbours at hand."""

    @abc.abstractmethod
    def search(self) -> None:
        """Find the neighbours at the start anew, as a step does."""

    @abc.abstractmethod
    def derivative(self) -> tuple[np.ndarray, np.ndarray]:
        """Accelerations [m/s^2] and rates of density [kg/m^3/s] at the start."""

    @abc.abstractmethod
    def prepare_run(self) -> tuple[int, float]:
        """Compile what a run needs; steps of a slice and dt [s]."""

    @abc.abstractmethod
    def run_slice(self) -> str | None:
        """Go on by one slice; the fault that ended the run, if any."""

    @abc.abstractmethod
    def fields(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Positions, velocities and pressures of the run."""

    def load(self, **case) -> dict[str, Any]:
        start = clock.perf_counter()
        found = self.setup(Case(**case))
        self.evaluate()
        self.search()
        return {"setup_seconds": clock.perf_counter() - start, "versions": self.versions(), **found}

    def right_hand_side(self, count: int) -> dict[str, float]:
        return timed(self.evaluate, count)

    def neighbors(self, count: int) -> dict[str, float]:
        return timed(self.search, count)

    def rates(self, path: str) -> dict[str, Any]:
        acceleration, density_rate = self.derivative()
        np.savez(path, acceleration=acceleration, density_rate=density_rate)
        return {}

    def prepare(self) -> dict[str, Any]:
        start = clock.perf_counter()
        steps, time_step = self.prepare_run()
        seconds = clock.perf_counter() - start
        return {"steps": steps, "time_step": time_step, "setup_seconds": seconds}

    def advance(self) -> dict[str, Any]:
        start, busy = clock.perf_counter(), clock.process_time()
        fault = self.run_slice()
        seconds = {"seconds": clock.perf_counter() - start, "busy": clock.process_time() - busy}
        return {**seconds, "fault": fault}

    def state(self, path: str) -> dict[str, Any]:
        position, velocity, pressure = self.fields()
        np.savez(path, position=position, velocity=velocity, pressure=pressure)
        return {}


def timed(call, count: int) -> dict[str, float]:
    """Wall and process time [s] of a call, mean over `count` calls."""
    start, busy = clock.perf_counter(), clock.process_time()
    for _ in range(count):
        call()
    return {
        "seconds": (clock.perf_counter() - start) / count,
        "busy": (clock.process_time() - busy) / count,
    }


def serve(side: Side) -> None:
    """Answer requests on stdin until it closes; what the code itself prints goes to stderr."""
    replies = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    for line in sys.stdin:
        request = json.loads(line)
        try:
            reply = _answer(side, **request)
        except Exception as error:  # any fault of a peer is a result, and the next case may do
            traceback.print_exc()
            reply = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(reply), file=replies, flush=True)


def _answer(side: Side, do: str, **arguments) -> dict[str, Any]:
    if do not in REQUESTS:
        raise ValueError(f"do: one of {', '.join(REQUESTS)}, got {do!r}.")
    return getattr(side, do)(**arguments)
