"""Full runs of a cylinder's wake, made once and kept, and what its lift is."""

from __future__ import annotations

import dataclasses
from functools import cache
from pathlib import Path

import numpy as np
from scipy.optimize import curve_fit

from jaxsph import Trajectory, run_scene
from jaxsph.scenes import Scene, continued, cylinder
from jaxsph.scenes.cylinder import DIAMETER, SPEED
from jaxsph_rom.study import with_record

DOMAIN = {"width": 6.0, "upstream": 4.0, "downstream": 6.0}  # m
_NUDGE = 1e-3  # dx
_STRENGTH = 5.0  # s, about a period
STEP, EACH = 1.5e-2, 20  # s, steps to a snapshot, for 10 particles a diameter


class WakeRuns:
    """Runs at any Reynolds number, on from the developed wake at the first one.

    Args:
        folder: where they are kept; what was cut short goes on from there.
        resolution: particles a diameter.
        first: Reynolds number of the run from the start.
        developed: how long that takes to shed regularly [s].
        adapted: how long a run at another number takes until it is recorded [s]; 0 for one that is
            recorded from the end of the first on.
        recorded: and how long it is then [s].
    """

    def __init__(
        self,
        folder: Path,
        resolution: int,
        first: float = 100.0,
        developed: float = 60.0,
        adapted: float = 18.0,
        recorded: float = 18.0,
    ):
        self.folder, self.resolution, self.first = folder, resolution, first
        self.developed, self.adapted, self.recorded = developed, adapted, recorded
        self.run = cache(self._run)

    def scene(self, reynolds: float, end_time: float) -> Scene:
        """The scene from its uniform start."""
        step = STEP * 10 / self.resolution
        each = round(EACH * self.resolution / 10)
        steps = each * round(end_time / (each * step))
        scene = cylinder(self.resolution, reynolds, time_step=step, end_time=steps * step, **DOMAIN)
        return dataclasses.replace(scene, steps_per_snapshot=each)

    def _from_start(self) -> tuple[Scene, Trajectory]:
        scene = self.scene(self.first, self.developed)
        return scene, self._kept("start", scene)

    def after(self, before: Scene, state, scene: Scene, how: str) -> Scene:
        """A scene that goes on from a state of another."""
        return with_record(continued(scene, state, before.space), before=how)

    def _run(
        self, reynolds: float, recorded: float | None = None, nudged: bool = False
    ) -> tuple[Scene, Trajectory]:
        """The scene of what is recorded, and its run; from particles all of them a thousandth of a
        spacing elsewhere, if it is nudged."""
        before, run = self._from_start()
        how = "steady"
        if self.adapted:
            adapting = self.scene(reynolds, self.adapted)
            before = self.after(before, run.state(-1), adapting, "developed")
            run, how = self._kept(f"adapt-{reynolds:g}", before), "adapted"
        seconds = self.recorded if recorded is None else recorded
        state, name = run.state(-1), f"record-{reynolds:g}-{seconds:g}s"
        if nudged:
            away = np.random.default_rng(0).normal(scale=_NUDGE, size=state.position.shape)
            away = (away * before.space.spacing).astype(state.position.dtype)
            state = dataclasses.replace(state, position=state.position + away)
            how, name = f"{how}-nudged", f"{name}-nudged"
        scene = self.after(before, state, self.scene(reynolds, seconds), how)
        return scene, self._kept(name, scene)

    def _kept(self, name: str, scene: Scene) -> Trajectory:
        return run_scene(scene, path=self.folder / f"{name}.h5", progress=True)


def onset(time, lift) -> float | None:
    """When lift, as strong as it is within five seconds, has come to half of its strength in the
    last quarter, for good [s]; None if it is weaker at the end."""
    count = max(2, round(_STRENGTH / (time[1] - time[0])))
    swing = lift - np.mean(lift[-len(lift) // 4 :])
    strength = np.sqrt(np.convolve(swing**2, np.full(count, 1.0 / count), mode="valid"))
    middle = time[: len(strength)] + 0.5 * (count - 1) * (time[1] - time[0])
    late = strength[middle > 0.75 * time[-1]].mean()
    weak = np.flatnonzero(strength < 0.5 * late)
    if not len(weak):
        return 0.0
    return None if weak[-1] + 1 == len(strength) else float(middle[weak[-1] + 1])


def harmonic(time, drag, lift) -> dict[str, float]:
    """Mean drag, and the sine that lift is, with its phase at the end [rad]."""

    def sine(t, mean, along, across, frequency):
        angle = 2.0 * np.pi * frequency * t
        return mean + along * np.sin(angle) + across * np.cos(angle)

    step = time[1] - time[0]
    powers = np.abs(np.fft.rfft(lift - lift.mean()))
    first = np.fft.rfftfreq(len(lift), step)[1 + powers[1:].argmax()]
    found, _ = curve_fit(sine, time, lift, (lift.mean(), lift.std(), lift.std(), first))
    mean, along, across, frequency = found
    return {
        "drag": float(drag.mean()),
        "lift_mean": float(mean),
        "lift_amplitude": float(np.hypot(along, across)),
        "lift_left_rms": float(np.std(lift - sine(time, *found))),
        "strouhal": float(abs(frequency) * DIAMETER / SPEED),
        "phase": float(np.arctan2(across, along) + 2.0 * np.pi * frequency * time[-1]),
        "periods": float(abs(frequency) * (time[-1] - time[0])),
    }
