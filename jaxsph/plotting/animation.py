"""A run as a moving picture, GIF or MP4."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter

from ..domain import Box
from ..io import (
    BodyShapes,
    check_target,
    read_body_shapes,
    read_box,
    read_walls,
    snapshot_blocks,
    walls_with_bodies,
)
from ..trajectory import Trajectory
from .fields import VELOCITY, ParticleField
from .images import fit_box, with_images
from .particles import (
    draw_particles,
    draw_walls,
    fit_squares,
    grey_squares,
    middle_layer,
    spacing,
)
from .snapshot import label_panel, panel_size
from .style import INK, TEXT, sheet

_DPI = 100
_TAILS = (0.01, 0.99)  # quantiles of the whole run that the colours span; an impact may be out
_LADDER = np.linspace(0.0, 1.0, 201)  # quantiles of a frame that stand for its values


def animate(
    source: str | os.PathLike,
    path: str | os.PathLike,
    field: ParticleField = VELOCITY,
    every: int = 1,
    frames_per_second: int = 15,
    progress: Callable[[int], None] | None = None,
) -> Path:
    """Draw the particles of a trajectory file, coloured by a field, at all its times.

    Axes span the whole run and its walls, colours all but one percent of its values at either end.
    The file is read twice, one snapshot at a time. The frames of a GIF are held in memory until its
    end, about a megabyte each; those of an MP4 are not.

    Args:
        source: the trajectory file.
        path: of the picture, ending with `.gif` or `.mp4`; one that is there is replaced.
        field: colours the particles.
        every: show every N-th snapshot, from the first on.
        frames_per_second: of the picture.
        progress: is called with the number of frames drawn since its last call.

    Raises:
        ValueError: if the ending is another, `every` or the number of frames is below 1, or an MP4
            is asked for where there is no ffmpeg.
        TrajectoryFileError: if the source is not a whole trajectory file with a snapshot in it, or
            the picture's folder does not serve.
    """
    blocks, walls, box = partial(snapshot_blocks, source, 1), read_walls(source), read_box(source)
    shapes = read_body_shapes(source)
    return draw_animation(
        blocks, path, field, every, frames_per_second, progress, walls, box, shapes
    )


def draw_animation(
    snapshots: Callable[[int], Iterator[Trajectory]],
    path: str | os.PathLike,
    field: ParticleField = VELOCITY,
    every: int = 1,
    frames_per_second: int = 15,
    progress: Callable[[int], None] | None = None,
    walls: np.ndarray | None = None,
    box: Box | None = None,
    shapes: BodyShapes | None = None,
) -> Path:
    """As `animate`, of the snapshots that `snapshots(every)` gives one by one, each time anew, with
    walls whose ghosts are at given places (G, n) [m], in a box that may be periodic, and with free
    bodies of given shapes."""
    path = Path(path)
    if path.suffix not in _WRITERS:
        raise ValueError(f"{path}: pictures end with {' or '.join(_WRITERS)}; name it so.")
    if frames_per_second < 1:
        raise ValueError(f"frames_per_second: {frames_per_second}; give at least 1.")
    blocks = snapshots(every)
    check_target(path)
    writer, settings = _WRITERS[path.suffix](frames_per_second)
    view = _View.of(snapshots(every), field)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f"{path.stem}.part{path.suffix}")
    try:
        with matplotlib.rc_context(settings):
            _draw(blocks, writer, part, field, view, progress, walls, box, shapes)
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
    return path


def _draw(
    blocks, writer: AbstractMovieWriter, path, field, view: _View, progress, walls, box, shapes
):
    """All frames into a picture."""
    first = next(blocks)
    corners = np.stack([view.low, view.high])
    flat = walls is not None and walls.shape[1] == 2
    width, height = panel_size(np.concatenate([corners, walls]) if flat else corners)
    figure = sheet(width + 1.6, height + 0.9)
    axes = figure.subplots()
    color_map, limits = field.colours(*view.values)
    squares = draw_particles(axes, *_shown(first, field), color_map, limits)
    margin = 0.5 * spacing(np.asarray(squares.get_offsets()))
    axes.set(
        xlim=(view.low[0] - margin, view.high[0] + margin),
        ylim=(view.low[1] - margin, view.high[1] + margin),
    )
    fit_box(axes, box)
    solid, reach = _solid(first, walls, shapes), 2.0 * margin
    in_space = shapes is not None and shapes.arm.shape[1] == 3
    still = (grey_squares(axes, solid),) if in_space else draw_walls(axes, solid)
    label_panel(figure, axes, squares, field.label, extend="both")
    title = axes.set_title(view.title(first), fontsize=TEXT, color=INK)
    fit_squares(figure, [(axes, squares, *still)])
    figure.set_layout_engine("none")  # nothing moves but particles and bodies
    with writer.saving(figure, str(path), _DPI):
        block = first
        while block is not None:
            position, value = _shown(block, field)
            position, index = with_images(position, box, reach)
            squares.set_offsets(position)
            squares.set_array(value[index])
            for grey in still:
                grey.set_offsets(_solid(block, walls, shapes))
            title.set_text(view.title(block))
            writer.grab_frame()
            if progress is not None:
                progress(1)
            block = next(blocks, None)


def _solid(block: Trajectory, walls, shapes: BodyShapes | None) -> np.ndarray | None:
    """Places (G, 2) [m] of what is drawn grey: walls and bodies, of three dimensions what of the
    bodies is in the layer of the particles drawn."""
    snapshot = block.snapshot(0).in_flow()
    if snapshot.position.shape[1] == 2 or shapes is None:
        return walls_with_bodies(walls, shapes, snapshot.bodies)
    places = shapes.places(snapshot.bodies)
    return places[middle_layer(snapshot.position, places), :2]


def _shown(block: Trajectory, field: ParticleField) -> tuple[np.ndarray, np.ndarray]:
    """Positions (P, 2) [m] and values (P,) of the particles drawn."""
    snapshot = block.snapshot(0).in_flow()
    shown = middle_layer(snapshot.position)
    return snapshot.position[shown, :2], field.value(snapshot)[shown]


@dataclass(frozen=True)
class _View:
    """What a whole run spans: positions (2,) [m], values of a field, and the title of a frame."""

    low: np.ndarray
    high: np.ndarray
    values: tuple[float, float]
    scene: str
    decimals: int

    @classmethod
    def of(cls, blocks: Iterator[Trajectory], field: ParticleField) -> _View:
        lows, highs, values, times = [], [], [], []
        for block in blocks:
            position, value = _shown(block, field)
            lows.append(position.min(axis=0))
            highs.append(position.max(axis=0))
            values.append(np.quantile(value, _LADDER))
            times.append(block.time[0])
        interval = times[1] - times[0] if len(times) > 1 else 1.0
        return cls(
            np.min(lows, axis=0),
            np.max(highs, axis=0),
            tuple(np.quantile(values, _TAILS)),
            str(block.metadata.get("scene", "")),
            int(np.clip(1 - np.floor(np.log10(interval)), 0, 9)),
        )

    def title(self, block: Trajectory) -> str:
        return f"{self.scene}, t = {block.time[0]:.{self.decimals}f} s"


def _gif(frames_per_second: int) -> tuple[AbstractMovieWriter, dict[str, str]]:
    return PillowWriter(fps=frames_per_second), {}


def _mp4(frames_per_second: int) -> tuple[AbstractMovieWriter, dict[str, str]]:
    return FFMpegWriter(fps=frames_per_second), {"animation.ffmpeg_path": _ffmpeg()}


def _ffmpeg() -> str:
    """The program, of the system or of the package that brings one."""
    found = shutil.which("ffmpeg")
    if found is not None:
        return found
    try:
        import imageio_ffmpeg

        return imageio_ffmpeg.get_ffmpeg_exe()
    except (ImportError, RuntimeError):
        raise ValueError(
            "ffmpeg, which writes MP4, is not there; install it, or the extra jaxsph[movie], "
            "or name a .gif."
        ) from None


_WRITERS = {".gif": _gif, ".mp4": _mp4}
