"""Bodies from files of outlines and of closed surfaces."""

from __future__ import annotations

import importlib
import math
from pathlib import Path
from typing import Any

import numpy as np

from .outline import Outline
from .sampled_distance import SampledDistance

_DRAWINGS = (".svg", ".dxf")
_MARGIN = 3  # nodes of the grid around a body
_POINTS = 50_000  # whose distance to a surface is found at a time


def outline_from_file(
    path: str | Path, *, scale: float = 1.0, offset: tuple[float, float] = (0.0, 0.0)
) -> Outline:
    """A body's outline from a drawing, or from a table of corners.

    SVG and DXF drawings are read by trimesh (`pip install "jaxsph[geometry]"`); curves become
    polygons. Any other file is a table of two columns x, y with one polygon, or several with empty
    lines between them; lines that do not hold two numbers, such as the name on top of an airfoil's
    file, are passed over. An airfoil's table may also be Lednicer's: the numbers of corners of its
    upper and its lower side, then either side from the leading edge on, x growing along both. An
    SVG's y points down: what it holds is turned up about its middle, so that it stands as drawn
    between the numbers of its file.

    Args:
        path: of the file.
        scale: metres per unit of the file.
        offset: of the file's origin [m], after scaling.

    Raises:
        ValueError: if the file is not there, holds no closed outline, or trimesh is missing.
    """
    path = _existing(path)
    if path.suffix.lower() in _DRAWINGS:
        polygons = _drawing(path).polygons_full
        if not len(polygons):
            raise ValueError(f"{path}: holds no closed outline; close its lines.")
        rings = [np.asarray(r.coords)[:, :2] for p in polygons for r in (p.exterior, *p.interiors)]
        if path.suffix.lower() == ".svg":
            heights = np.concatenate(rings)[:, 1]
            middle = heights.min() + heights.max()
            rings = [np.stack([ring[:, 0], middle - ring[:, 1]], axis=1) for ring in rings]
    else:
        rings = _table(path)
    try:
        return Outline([scale * np.asarray(ring) + np.asarray(offset) for ring in rings])
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def solid_from_file(
    path: str | Path,
    spacing: float,
    *,
    scale: float = 1.0,
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> SampledDistance:
    """A body within a closed surface of triangles: STL, OBJ, PLY, ... as trimesh reads them.

    Its signed distance is taken on a grid once (`pip install "jaxsph[geometry]"`).

    Args:
        path: of the file.
        spacing: of the grid [m]; half the particles' spacing keeps a surface within a hundredth of
            that where it is curved no more than the particles can follow.
        scale: metres per unit of the file.
        offset: of the file's origin [m], after scaling.

    Raises:
        ValueError: if the file is not there, holds no closed surface, or trimesh is missing.
    """
    path = _existing(path)
    if not spacing > 0.0:
        raise ValueError(f"spacing: must be positive, got {spacing:g} m.")
    trimesh = _trimesh("a surface")
    try:
        mesh = trimesh.load_mesh(str(path))
    except (ValueError, KeyError, OSError, NotImplementedError) as error:
        raise ValueError(f"{path}: could not be read as a surface of triangles: {error}") from None
    if not mesh.is_watertight:
        raise ValueError(
            f"{path}: its surface is not closed, so that nothing is inside; close its holes, by "
            "trimesh's `repair.fill_holes` or in the program that made it."
        )
    if not mesh.is_winding_consistent:
        mesh.fix_normals()  # outwards, which is how the inside is told
    elif mesh.volume < 0.0:
        mesh.invert()  # as a whole: a cavity's surface faces into it
    mesh.apply_scale(scale)
    mesh.apply_translation(offset)
    lower, upper = mesh.bounds
    counts = [math.ceil(length / spacing) + 1 + 2 * _MARGIN for length in upper - lower]
    lower = 0.5 * (lower + upper - spacing * (np.asarray(counts) - 1))
    axes = [start + spacing * np.arange(count) for start, count in zip(lower, counts, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    blocks = np.array_split(nodes, math.ceil(len(nodes) / _POINTS))
    inside = [trimesh.proximity.signed_distance(mesh, block) for block in blocks]
    return SampledDistance(tuple(lower), spacing, -np.concatenate(inside).reshape(counts))


def _existing(path: str | Path) -> Path:
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"{path}: no such file.")
    return path


def _drawing(path: Path) -> Any:
    trimesh = _trimesh("an SVG or DXF file")
    try:
        return trimesh.load_path(str(path))
    except Exception as error:  # of the XML reader, of number words, of shapes: each has its own
        raise ValueError(f"{path}: could not be read as a drawing: {error}") from None


def _trimesh(what: str) -> Any:
    try:
        importlib.import_module("rtree")  # which it asks for late, and without saying so
        importlib.import_module("shapely")
        return importlib.import_module("trimesh")
    except ImportError:
        raise ValueError(
            f'{what} is read by trimesh, which is not installed; `pip install "jaxsph[geometry]"`.'
        ) from None


def _table(path: Path) -> list[list[tuple[float, float]]]:
    """Polygons of a table of corners, with empty lines between them."""
    rings: list[list[tuple[float, float]]] = [[]]
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except UnicodeDecodeError:
        raise ValueError(f"{path}: is no table of corners; give text with two columns.") from None
    for line in lines:
        words = line.replace(",", " ").replace(";", " ").split()
        if not words and rings[-1]:
            rings.append([])
        try:
            x, y = map(float, words)
        except ValueError:
            continue
        rings[-1].append((x, y))
    rings = [ring for ring in rings if ring]
    if not rings:
        raise ValueError(f"{path}: holds no corners; give a table of two columns x, y in metres.")
    return _as_one_airfoil(rings)


def _as_one_airfoil(rings: list[list[tuple[float, float]]]) -> list[list[tuple[float, float]]]:
    """The one polygon of a table whose first line counts the corners of two sides; others as they
    are."""
    (counts, *rest), *others = rings
    corners = [*rest, *(corner for other in others for corner in other)]
    number = int(counts[0]) if math.isfinite(counts[0]) else 0
    upper, lower = sides = corners[:number], corners[number:]
    if (
        tuple(map(len, sides)) != counts
        or min(counts) < 3
        or any(side != sorted(side, key=lambda corner: corner[0]) for side in sides)
        or upper[0][0] != lower[0][0]
    ):
        return rings
    return [upper[::-1] + lower[upper[0] == lower[0] :]]
