"""A run with a slider for its time: drawn by the page itself, on a canvas, without a network."""

from __future__ import annotations

import base64
import json
import os
from typing import Any

import matplotlib
import numpy as np
from matplotlib.colors import to_hex

from ..io import read_body_shapes, read_box, read_overview, read_walls, snapshot_blocks
from ..plotting import FIELDS, ParticleField
from ..plotting.images import with_images
from ..plotting.particles import OVERLAP, middle_layer, spacing
from .film_script import SCRIPT

FRAMES = 40  # at most
_BYTES = 3_000_000  # of all frames; base64 makes a third more of them
_TAILS = (0.01, 0.99)  # quantiles of the whole run that the colours span
_STEPS = 65535  # of a place across the picture and what is around it
_AROUND = 0.25  # of the picture at each side, where images stand


def film(source: str | os.PathLike) -> str:
    """A piece of a page: the particles of a trajectory file at some of its times, the fields to be
    chosen, walls grey; colours span all but one percent of a run's values at either end.

    Of a long or a large run fewer times are taken, and of three dimensions the middle layer.

    Raises:
        TrajectoryFileError: if the source is not a whole trajectory file with a snapshot in it.
    """
    overview, fields = read_overview(source), tuple(FIELDS.values())
    room = max(2, _BYTES // (overview.particles * (4 + len(fields))))
    every = -(-overview.snapshots // min(FRAMES, room))
    times, places, values = [], [], [[] for _ in fields]
    box, shapes, reach = read_box(source), read_body_shapes(source), None
    for block in snapshot_blocks(source, 1, every):
        snapshot = block.snapshot(0).in_flow()
        shown = middle_layer(snapshot.position)
        times.append(float(block.time[0]))
        place = np.asarray(snapshot.position[shown, :2], np.float32)
        reach = spacing(place) if reach is None else reach
        place, index = with_images(place, box, reach)
        solid = np.zeros((0, 2), np.float32)  # free bodies, grey as what has no value
        if shapes is not None:
            solid = np.float32(shapes.places(snapshot.bodies))
            solid = solid[middle_layer(snapshot.position, solid), :2]
        places.append(np.concatenate([place, solid]))
        grey = np.full(len(solid), np.nan, np.float32)
        for kept, field in zip(values, fields, strict=True):
            value = np.asarray(field.value(snapshot)[shown][index], np.float32)
            kept.append(np.concatenate([value, grey]))
    walls = read_walls(source)
    walls = walls if walls is not None and walls.shape[1] == 2 else np.zeros((0, 2), np.float32)
    return _piece(times, places, values, fields, walls, box)


def _piece(times, places, values, fields, walls, box) -> str:
    everything = np.concatenate([*places, walls])
    side = OVERLAP * spacing(places[0])  # a splash has no spacing of its own
    low = np.nanmin(everything, axis=0) - 0.5 * side
    high = np.nanmax(everything, axis=0) + 0.5 * side
    for axis in range(2):  # images are drawn up to the faces of the box
        if box is not None and box.periodic[axis]:
            low[axis], high[axis] = box.lower[axis], box.upper[axis]
    extent = high - low

    def scaled(position: np.ndarray) -> bytes:
        share = (np.nan_to_num((position - low) / extent) + _AROUND) / (1.0 + 2.0 * _AROUND)
        return np.clip(_STEPS * share, 0, _STEPS).astype("<u2").tobytes()

    told: dict[str, Any] = {
        "times": times,
        "counts": [len(place) for place in places],
        "places": _text(b"".join(map(scaled, places))),
        "walls": _text(scaled(walls)),
        "extent": extent.tolist(),
        "around": _AROUND,
        "side": side / float(extent[0]),
        "fields": [_field(*pair) for pair in zip(fields, values, strict=True)],
    }
    data = json.dumps(told).replace("<", "\\u003c")
    return f'<div class="film"></div><script>({SCRIPT})(document.currentScript, {data})</script>'


def _field(field: ParticleField, values: list[np.ndarray]) -> dict[str, Any]:
    known = np.concatenate(values)
    known = known[np.isfinite(known)]
    low, high = np.quantile(known, _TAILS).tolist() if len(known) else (0.0, 1.0)
    name, (low, high) = field.colours(low, high)
    share = (np.concatenate(values) - low) / (high - low)
    index = np.where(np.isfinite(share), np.clip(np.nan_to_num(254.0 * share), 0, 254), 255)
    colours = [to_hex(matplotlib.colormaps[name](k / 254.0)) for k in range(255)]
    return {
        "label": field.label.replace("$", ""),
        "low": low,
        "high": high,
        "colours": [*colours, "#d9d9d9"],  # the last one of what is no number
        "values": _text(index.astype(np.uint8).tobytes()),
    }


def _text(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")
