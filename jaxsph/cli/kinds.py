"""What a setting must be, by the annotation of its parameter."""

from __future__ import annotations

import inspect
import math
from typing import Any

PLAIN = {"int": int, "float": (int, float), "str": str}
_TOLD = {"int": "a whole number", "float": "a finite number", "str": "a word"}


def plain_kinds(parameter: inspect.Parameter) -> tuple[str, ...]:
    """The names of plain kinds, one, or one for each place of a tuple; none for anything else."""
    kind = parameter.annotation
    if kind is inspect.Parameter.empty:
        return ()
    kind = kind if isinstance(kind, str) else inspect.formatannotation(kind)
    kind = kind.removesuffix(" | None")
    if kind.startswith("tuple["):
        parts = tuple(kind[len("tuple[") : -1].split(", "))
        return parts if set(parts) <= set(PLAIN) else ()
    return (kind,) if kind in PLAIN else ()


def check_kind(parameter: inspect.Parameter, value: Any) -> None:
    """A ValueError if a value is not what a plain annotation asks for."""
    kinds = plain_kinds(parameter)
    if not kinds or (value is None and parameter.default is None):
        return
    several = "tuple[" in str(parameter.annotation)
    values = tuple(value) if several and isinstance(value, (tuple, list)) else (value,)
    if len(values) != len(kinds) or not all(map(_fits, kinds, values)):
        wanted = _TOLD[kinds[0]] if not several else f"{len(kinds)} values, each {_TOLD[kinds[0]]}"
        raise ValueError(f"--set: {parameter.name} is {wanted}, got {value!r}.")


def _fits(kind: str, value: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, PLAIN[kind]):
        return False
    return isinstance(value, str) or math.isfinite(value)
