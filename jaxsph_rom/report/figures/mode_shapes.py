"""Modes as fields on the particles or reference points that carry them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from jaxsph.plotting.particles import draw_particles, fit_squares, plane
from jaxsph.plotting.style import INK, SIGNED_MAP, SMALL, TEXT, finite_range, save, sheet

COMPONENTS = ("density", "velocity x", "velocity y")
PANEL = 1.65  # side of a square panel [inch]
NAMES, BAR = 0.3, 1.0  # room for the names of the rows and for the colour bar [inch]

Space = tuple[str, np.ndarray, np.ndarray]


def modes(spaces: Sequence[Space], numbers: Sequence[int], path: str | os.PathLike[str]) -> Path:
    """Density and velocity of chosen modes: a block of columns per space, a row per component.

    Modes have no unit and no sign; each panel is scaled by its own largest magnitude, which
    stands above it.

    Args:
        spaces: label, positions (N, 2) [m] and modes (N, 1 + 2, K) of each space.
        numbers: which modes, counted from 1.
        path: the file to write.
    """
    if not spaces or not numbers:
        raise ValueError("spaces, numbers: got none; give at least one space and one mode number")
    spaces = [_checked(space, numbers) for space in spaces]
    first = spaces[0][1]
    width, height = np.nanmax(first, axis=0) - np.nanmin(first, axis=0)
    tall = PANEL * min(max(height / width, 0.3), 1.5)
    columns = len(spaces) * len(numbers)
    figure = sheet(PANEL * columns + NAMES * len(spaces) + BAR, 3 * (tall + 0.2) + 0.75)
    blocks = figure.subfigures(
        1, len(spaces) + 1, width_ratios=[len(numbers) * PANEL + NAMES] * len(spaces) + [BAR]
    )
    drawn = []
    for block, (label, position, values) in zip(blocks, spaces, strict=False):
        block.suptitle(label, color=INK, fontsize=TEXT + 1)
        grid = block.subplots(len(COMPONENTS), len(numbers), squeeze=False)
        for (row, column), axes in np.ndenumerate(grid):
            value = values[:, row, numbers[column] - 1]
            found = finite_range([np.abs(value)])
            size = found[1] if found else float("nan")
            squares = draw_particles(axes, position, value / (size or 1.0), SIGNED_MAP, (-1.0, 1.0))
            drawn.append((axes, squares))
            magnitude = f"max {np.format_float_scientific(size, 2, trim='-', exp_digits=1)}"
            name = f"mode {numbers[column]}\n" if row == 0 else ""
            axes.set_title(name + magnitude, fontsize=SMALL, color=INK, pad=3)
            axes.set(xticks=[], yticks=[])
            if column == 0:
                axes.set_ylabel(COMPONENTS[row], fontsize=TEXT, color=INK)
    bar = blocks[-1].colorbar(drawn[0][1], cax=blocks[-1].add_axes((0.1, 0.2, 0.17, 0.6)))
    bar.set_ticks([-1, -0.5, 0, 0.5, 1])
    bar.ax.tick_params(labelsize=SMALL, colors=INK)
    bar.set_label("mode / its largest magnitude", fontsize=TEXT, color=INK)
    fit_squares(figure, drawn)
    return save(figure, path)


def _checked(space: Space, numbers: Sequence[int]) -> Space:
    label, position, values = space
    position, values = plane(label, position), np.asarray(values)
    if values.ndim != 3 or values.shape[:2] != (len(position), len(COMPONENTS)):
        raise ValueError(
            f"spaces: modes of {label!r} have shape {values.shape}; "
            f"give ({len(position)}, {len(COMPONENTS)}, K), density first"
        )
    if min(numbers) < 1 or max(numbers) > values.shape[2]:
        raise ValueError(
            f"numbers: got {tuple(numbers)}; {label!r} has modes 1 to {values.shape[2]}"
        )
    return label, position, values
