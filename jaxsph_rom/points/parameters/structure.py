"""Where two scenes differ in their structure."""

from __future__ import annotations

import dataclasses
from functools import partial
from types import FunctionType
from typing import Any

import equinox as eqx
import jax
import numpy as np


def difference(mine: Any, theirs: Any, path: str = "scene", free: bool = True) -> str | None:
    """The place of the first difference between two objects, None if there is none.

    Arrays may have other values where they are data, not where they are structure; functions are
    the same if their code and what they hold are.

    Args:
        mine, theirs: to compare.
        path: their name.
        free: whether they are data.
    """
    if type(mine) is not type(theirs) and not (_is_array(mine) and _is_array(theirs)):
        return path
    if _is_array(mine):
        if mine.shape != theirs.shape or mine.dtype != theirs.dtype:
            return path
        return None if free or np.array_equal(mine, theirs) else path
    if isinstance(mine, float) and free:
        return None
    parts: list[tuple[str, Any, Any, bool]] = []
    if dataclasses.is_dataclass(mine):
        data = isinstance(mine, eqx.Module)
        for field in dataclasses.fields(mine):
            open_ = free and data and not field.metadata.get("static", False)
            name = field.name
            parts.append((f"{path}.{name}", getattr(mine, name), getattr(theirs, name), open_))
    elif isinstance(mine, tuple | list):
        if len(mine) != len(theirs):
            return path
        pairs = zip(mine, theirs, strict=True)
        parts += [(f"{path}[{k}]", a, b, free) for k, (a, b) in enumerate(pairs)]
    elif isinstance(mine, dict):
        if mine.keys() != theirs.keys():
            return path
        parts += [(f"{path}[{key!r}]", mine[key], theirs[key], free) for key in mine]
    elif isinstance(mine, partial):
        parts = [(path, (mine.func, mine.args, mine.keywords),
                  (theirs.func, theirs.args, theirs.keywords), False)]  # fmt: skip
    elif isinstance(mine, FunctionType):
        if mine.__code__ != theirs.__code__:
            return path
        parts = [(f"{path}, what the function holds", _held(mine), _held(theirs), False)]
    elif mine is not theirs and mine != theirs:
        return path
    for place, a, b, open_ in parts:
        found = difference(a, b, place, open_)
        if found is not None:
            return found
    return None


def _held(function: FunctionType) -> tuple:
    cells = [cell.cell_contents for cell in function.__closure__ or ()]
    return tuple(cells), function.__defaults__, function.__kwdefaults__


def _is_array(value: Any) -> bool:
    return isinstance(value, np.ndarray | np.generic | jax.Array)
