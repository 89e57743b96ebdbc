"""Values as strict JSON can hold them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import PurePath
from typing import Any


def plain(value: Any) -> Any:
    """The same value of dict, list, str, int, float, bool and None only; NaN and infinity are None.

    Args:
        value: nested mappings, sequences, scalars and arrays (NumPy's or JAX's, any shape).

    Raises:
        ValueError: for a type that JSON has no form for.
    """
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, int):
        return int(value)
    if isinstance(value, PurePath):
        return str(value)
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        items = sorted(value) if isinstance(value, set | frozenset) else value
        return [plain(item) for item in items]
    if callable(getattr(value, "tolist", None)):  # arrays and their scalars
        return plain(value.tolist())
    raise ValueError(
        f"value: got {type(value).__name__}, which JSON cannot hold; "
        "give numbers, text, lists, dictionaries or arrays"
    )
