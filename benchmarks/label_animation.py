"""A wave by a reduced model on labels beside the full run, as a moving picture.

    python -m benchmarks.label_animation

The basin of the `standing-wave` scene at an amplitude and a viscosity that the model has not seen;
the full run on the left, the reduced one on the right. Written to `docs/figures/labels.gif`.
"""

from __future__ import annotations

import argparse
import time as clock
from dataclasses import replace
from pathlib import Path

import numpy as np

from jaxsph import Trajectory, run_scene
from jaxsph.metrics import surface_height
from jaxsph.scenes import Scene, standing_wave
from jaxsph_rom.labels import train

PICTURE = Path(__file__).parents[1] / "docs" / "figures" / "labels.gif"
RESOLUTION, MODES = 32, 3
TRAINED_ON = [{"amplitude": a, "reynolds": re} for a in (0.03, 0.06) for re in (500.0, 1000.0)]
UNSEEN = {"amplitude": 0.05, "reynolds": 700.0}


def wave(amplitude: float, reynolds: float) -> Scene:
    """Two periods but for a tenth of a second, which is also from snapshot to snapshot."""
    step = 0.4 / RESOLUTION
    scene = standing_wave(RESOLUTION, reynolds, amplitude=amplitude, time_step=step, end_time=7.0)
    return replace(scene, steps_per_snapshot=round(0.1 / step))


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, default=PICTURE, metavar="FILE",
                        help="the picture (default: %(default)s)")  # fmt: skip
    path = parser.parse_args(argv).out
    model, scene = train(wave, TRAINED_ON, MODES), wave(**UNSEEN)
    full = run_scene(scene)
    model.predict(UNSEEN)  # compiles
    start = clock.perf_counter()
    reduced = model.predict(UNSEEN)
    seconds = clock.perf_counter() - start
    reduced = reduced.fields(0)
    heights = [surface_height(run, scene, 0.0) for run in (full, reduced)]
    off = np.abs(heights[1] - heights[0]).max() / np.ptp(heights[0]) * 2.0
    print(f"height at the left end off by {off:.1%} of the amplitude at most; "
          f"full run {full.timing.run_seconds:.2g} s, reduced {seconds:.2g} s")  # fmt: skip
    both, walls = side_by_side(full, reduced, scene)
    both.animate(path, walls=walls, every=2, frames_per_second=8)
    print(f"wrote {path}")
    return 0


def side_by_side(
    one: Trajectory, other: Trajectory, scene: Scene
) -> tuple[Trajectory, np.ndarray]:
    """Both runs as one, the second to the right of the first, and the walls of both."""
    walls = np.asarray(scene.walls.fixed_position)
    walls = walls[walls[:, 1] < scene.state.position[:, 1].mean()]  # the floor
    right = np.array([np.ptp(walls[:, 0]) + 4.0 * scene.space.spacing, 0.0])
    fields = {
        name: np.concatenate([getattr(one, name), getattr(other, name)], axis=1)
        for name in ("velocity", "density", "pressure")
    }
    position = np.concatenate([one.position, other.position + right], axis=1)
    return Trajectory(one.time, position, **fields, metadata=one.metadata), np.concatenate(
        [walls, walls + right]
    )


if __name__ == "__main__":
    raise SystemExit(main())
