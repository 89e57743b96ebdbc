"""What functions and classes do: their code, and the settings in it."""

from __future__ import annotations

import hashlib
import types
from collections.abc import Mapping
from typing import Any

import jax
import numpy as np

# whose code is known by its name
_RELEASED = ("jaxsph", "jaxsph_rom", "jax", "numpy", "equinox", "builtins", "abc", "typing")
PLAIN = (bool, int, float, str, type(None), np.generic)
_SETTINGS = (*PLAIN, tuple, dict, np.ndarray, jax.Array, types.FunctionType)  # beside code


def import_path(thing: Any) -> str:
    """Where a class or function is defined, as `package.module.Name`."""
    return f"{thing.__module__}.{thing.__qualname__}"


def function_parts(thing: types.FunctionType) -> tuple[str, Mapping[str, Any]]:
    """A function by its path and code, with what it closes over and reads of its module."""
    parts = {"defaults": thing.__defaults__ or (), "named_defaults": thing.__kwdefaults__ or {}}
    parts = {name: value for name, value in parts.items() if value}
    for name, cell in zip(thing.__code__.co_freevars, thing.__closure__ or (), strict=True):
        parts[f"({name})"] = cell.cell_contents
    path = import_path(thing)
    if _released(thing):
        return path, parts
    for name in sorted(set(thing.__code__.co_names) & set(thing.__globals__)):
        value = thing.__globals__[name]
        if isinstance(value, _SETTINGS):
            parts[f"({name})"] = value
    return f"{path} #{_code_digest(thing.__code__)}", parts


def members(kind: type) -> Mapping[str, Any]:
    """Methods and settings of a class, from those of its bases that are of no released package."""
    own = [base for base in reversed(kind.__mro__) if not _released(base)]
    found = {}
    for name, value in (item for base in own for item in vars(base).items()):
        for attribute in ("fget", "func", "__func__", "method"):  # of properties, say
            value = getattr(value, attribute, value)
        if isinstance(value, types.FunctionType) and (name[:2] != "__" or name == "__call__"):
            found[f"{name}()"] = value
        elif isinstance(value, _SETTINGS) and name[:1] != "_":
            found[name] = value
    return found


def _released(thing: Any) -> bool:
    return (thing.__module__ or "").partition(".")[0] in _RELEASED


def _code_digest(code: types.CodeType) -> str:
    """Of what the code does, wherever it stands."""
    inner = [_constant(value) for value in code.co_consts]
    return short_hash(code.co_code, repr((code.co_names, code.co_varnames, inner)).encode())


def _constant(value: Any) -> str:
    if isinstance(value, types.CodeType):
        return _code_digest(value)
    # a set has another order in each process
    return str(sorted(map(repr, value))) if isinstance(value, frozenset) else repr(value)


def short_hash(*data: bytes) -> str:
    return hashlib.sha256(b"\0".join(data)).hexdigest()[:16]
