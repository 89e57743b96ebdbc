"""Objects as records in files, and back: a rule by its name and its settings, values as JSON."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import math
import sys
from collections.abc import Mapping
from functools import singledispatch
from pathlib import PurePath
from types import ModuleType, NoneType
from typing import Any

import jax
import numpy as np


def record(thing: Any) -> str | dict[str, Any]:
    """The name of an object's class, with the object's settings if it has any.

    What a package of this library hands on has its name there, any other class its import path,
    `module:Name`.

    Examples:
        >>> from jaxsph.arrangements import JitteredLattice
        >>> from jaxsph.kernels import WendlandC2
        >>> from jaxsph.record import record
        >>> record(WendlandC2()), record(JitteredLattice(seed=3))
        ('WendlandC2', {'rule': 'JitteredLattice', 'amplitude': 0.2, 'seed': 3})
    """
    kind = type(thing)
    package = sys.modules.get(kind.__module__.rpartition(".")[0])
    own = kind.__module__.partition(".")[0] in ("jaxsph", "jaxsph_rom")
    offered = own and getattr(package, kind.__name__, None) is kind
    name = kind.__name__ if offered else f"{kind.__module__}:{kind.__qualname__}"
    settings = {
        field.name: plain(getattr(thing, field.name), f"{name}.{field.name}")
        for field in (dataclasses.fields(thing) if dataclasses.is_dataclass(thing) else ())
    }
    return {"rule": name, **settings} if settings else name


def restored(kept: Any, base: type, package: ModuleType) -> Any:
    """The object of a record.

    Args:
        kept: the record.
        base: class that the object must be of.
        package: that hands on the classes known by name.

    Raises:
        ValueError: if there is no such class, or it has no such settings.
    """
    settings = dict(kept) if isinstance(kept, Mapping) else {"rule": kept}
    kind = _found(settings.pop("rule", None), base, package)
    try:
        return kind(**settings)
    except TypeError as error:
        raise ValueError(f"{base.__name__.lower()}: {error}.") from None


def _found(name: Any, base: type, package: ModuleType) -> type:
    offered = {
        key: value
        for key, value in vars(package).items()
        if isinstance(value, type) and issubclass(value, base) and not inspect.isabstract(value)
    }
    if name in offered:
        return offered[name]
    what = base.__name__.lower()
    if not isinstance(name, str) or ":" not in name:
        raise ValueError(f"{what}: {name!r} is not known; choose one of {', '.join(offered)}.")
    module, _, path = name.partition(":")
    try:
        found = importlib.import_module(module)
        for part in path.split("."):
            found = getattr(found, part)
    except (ImportError, AttributeError) as error:
        raise ValueError(
            f"{what}: {name} is not found here ({error}); define it at the top of a module that "
            "can be imported."
        ) from None
    if not (isinstance(found, type) and issubclass(found, base)):
        raise ValueError(f"{what}: {name} is no {base.__name__}.")
    return found


@singledispatch
def plain(value: Any, name: str = "value") -> Any:
    """The same value of dict, list, str, int, float, bool and None only; NaN and infinity are None.

    Args:
        value: nested mappings, sequences, scalars and arrays (NumPy's or JAX's, any shape).
        name: of the value, for the error.

    Raises:
        ValueError: for a type that JSON has no form for.
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return record(value)
    raise ValueError(
        f"{name}: got {type(value).__name__}, which JSON cannot hold; "
        "give numbers, text, lists, dictionaries or arrays"
    )


@plain.register(NoneType)
@plain.register(bool)
def _same(value, name="value"):
    return value


@plain.register(int)
def _whole(value, name="value"):
    return int(value)


@plain.register(float)
def _number(value, name="value"):
    return float(value) if math.isfinite(value) else None


@plain.register(str)
@plain.register(PurePath)
@plain.register(np.dtype)
def _text(value, name="value"):
    return str(value)


@plain.register(np.generic)
@plain.register(np.ndarray)
@plain.register(jax.Array)
def _array(value, name="value"):
    return plain(np.asarray(value).tolist(), name)


@plain.register(Mapping)
def _mapping(value, name="value"):
    return {str(key): plain(item, f"{name}.{key}") for key, item in value.items()}


@plain.register(list)
@plain.register(tuple)
def _sequence(value, name="value"):
    return [plain(item, f"{name}[{k}]") for k, item in enumerate(value)]


@plain.register(set)
@plain.register(frozenset)
def _set(value, name="value"):
    return plain(sorted(value), name)
