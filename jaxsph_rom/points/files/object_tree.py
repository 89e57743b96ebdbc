"""Objects as groups of an HDF5 file, and back: one group an object, one entry a field."""

from __future__ import annotations

import dataclasses
import importlib
import json
from typing import Any

import h5py
import jax
import jax.numpy as jnp
import numpy as np

_PLAIN = (bool, int, float, str, type(None))


def write(group: h5py.Group, name: str, value: Any, path: str = "") -> None:
    """Write a value into a group under a name.

    Arrays become datasets; numbers, texts and what JSON holds attributes; dataclasses (modules
    among them), tuples and lists groups, with the class's import path; functions and classes
    their import path.

    Raises:
        ValueError: if something could not be read back: a function or a class that is no module's,
            or an object of another kind.
    """
    path = f"{path}.{name}".lstrip(".")
    if isinstance(value, _PLAIN):
        group.attrs[name] = json.dumps(value)
    elif isinstance(value, np.ndarray | jax.Array | np.generic):
        kind = "jax" if isinstance(value, jax.Array) else "numpy"
        group.create_dataset(name, data=np.asarray(value)).attrs["kind"] = kind
    elif isinstance(value, tuple | list):
        if _is_plain(value):
            part = "tuple" if isinstance(value, tuple) else "list"
            group.attrs[name] = json.dumps({part: value})
            return
        inner = group.create_group(name)
        inner.attrs["class of"] = "tuple" if type(value) is tuple else "list"
        if hasattr(value, "_fields"):
            inner.attrs["class of"] = imported(type(value), path)
        inner.attrs["length of"] = len(value)
        for k, item in enumerate(value):
            write(inner, str(k), item, path)
    elif isinstance(value, dict):
        group.attrs[name] = json.dumps({"dict": value}, default=_plain)
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        inner = group.create_group(name)
        inner.attrs["class of"] = imported(type(value), path)
        for field in dataclasses.fields(value):
            write(inner, field.name, getattr(value, field.name), path)
    elif callable(value):
        group.attrs[name] = json.dumps({"import": imported(value, path)})
    else:
        raise ValueError(
            f"{path}: {type(value).__name__} has no place in a file; make it an array, a number or "
            "a module of these."
        )


def read(group: h5py.Group, name: str) -> Any:
    """The value under a name."""
    if name in group.attrs:
        found = json.loads(group.attrs[name])
        if not isinstance(found, dict):
            return found
        ((kind, value),) = found.items()
        if kind == "import":
            return _named(value)
        return {"tuple": _tuples, "list": list, "dict": dict}[kind](value)
    part = group[name]
    if isinstance(part, h5py.Dataset):
        array = part[...]
        return jnp.asarray(array) if part.attrs["kind"] == "jax" else np.asarray(array)
    kind = part.attrs["class of"]
    if "length of" in part.attrs:
        items = [read(part, str(k)) for k in range(int(part.attrs["length of"]))]
        if kind in ("tuple", "list"):
            return tuple(items) if kind == "tuple" else items
        return _named(kind)(*items)
    made = _named(kind)
    new = object.__new__(made)
    for field in dataclasses.fields(made):
        object.__setattr__(new, field.name, read(part, field.name))
    return new


def imported(value: Any, path: str) -> str:
    """Where a class or a function is imported from.

    Raises:
        ValueError: if it is found there under no name.
    """
    module, name = getattr(value, "__module__", None), getattr(value, "__qualname__", "?")
    place = f"{module}:{name}"
    try:
        found = module != "__main__" and _named(place) is value
    except (ImportError, AttributeError, ValueError):
        found = False
    if not found:
        raise ValueError(
            f"{path}: {name} cannot be found again from a file; define it at the top of a module "
            "that can be imported."
        )
    return place


def _named(place: str) -> Any:
    module, name = place.split(":")
    found = importlib.import_module(module)
    for part in name.split("."):
        found = getattr(found, part)
    return found


def _plain(value: Any) -> Any:
    """A number or an array of numpy as JSON has it; anything else by what it says of itself."""
    return value.tolist() if hasattr(value, "tolist") else repr(value)


def _is_plain(value: Any) -> bool:
    if type(value) in (tuple, list):
        return all(map(_is_plain, value)) and len({type(v) for v in value}) <= 1
    return isinstance(value, _PLAIN)


def _tuples(value: Any) -> Any:
    return tuple(_tuples(v) if isinstance(v, list) else v for v in value)
