"""What an object holds, as names and short texts: by it kept runs are told apart.

Everything counts that changes a run: classes, settings, arrays, the code of functions and what they
close over. Numbers count to 12 digits (single precision: 6) and large arrays by a hash of values
rounded to 2^-36 (2^-18) of the largest, so that another processor's round-off makes no difference.
"""

from __future__ import annotations

import dataclasses
import hashlib
import types
from collections.abc import Mapping
from functools import cached_property, partial, singledispatch
from typing import Any

import jax
import numpy as np

Parts = Mapping[str, Any]

_SHOWN = 8  # values of an array that are written out
_TOLD = 3  # differences named in a message
_OFFSET = 0.377  # of the rounding, so that binary fractions are not on its borders
# whose code is known by its name
_RELEASED = ("jaxsph", "jaxsph_rom", "jax", "numpy", "equinox", "builtins", "abc", "typing")
_PLAIN = (bool, int, float, str, type(None), np.generic)
_SETTINGS = (*_PLAIN, tuple, dict, np.ndarray, jax.Array, types.FunctionType)  # beside code


def content(thing: Any) -> dict[str, str]:
    """What an object and its parts are, by the names of the parts, as `effects[2].viscosity`.

    Examples:
        >>> from jaxsph.content import content
        >>> from jaxsph.fluid import TaitEquationOfState
        >>> content(TaitEquationOfState())
        {'': 'jaxsph.fluid.TaitEquationOfState', 'exponent': '7'}

    Raises:
        ValueError: naming a part that cannot be told from others of its kind.
    """
    entries: dict[str, str] = {}
    _enter(entries, "", thing, ())
    return entries


def digest(thing: Any) -> str:
    """A short hash of an object's content, marked as one by `#`."""
    return "#" + _hash(repr(sorted(content(thing).items())).encode())


def differences(kept: Mapping[str, str], wanted: Mapping[str, str]) -> str:
    """What of the kept is not as wanted, in words; empty if nothing is."""
    names = [name for name in {**wanted, **kept} if kept.get(name) != wanted.get(name)]
    names.sort(key=lambda name: not name.startswith("parameters"))  # in the user's own words
    told = [_told(name, kept.get(name), wanted.get(name)) for name in names[:_TOLD]]
    if len(names) > _TOLD:
        told.append(f"{len(names) - _TOLD} more")
    return "; ".join(told)


def _told(name: str, kept: str | None, wanted: str | None) -> str:
    name = name or "it"
    if kept is not None and wanted is not None and "#" in kept and "#" in wanted:
        return f"{name} has other values"
    return f"{name} is {kept or 'missing'} there and {wanted or 'missing'} here"


def import_path(thing: Any) -> str:
    """Where a class or function is defined, as `package.module.Name`."""
    return f"{thing.__module__}.{thing.__qualname__}"


def _enter(entries: dict[str, str], name: str, thing: Any, above: tuple[int, ...]) -> None:
    if id(thing) in above:
        entries[name] = "itself"  # a function that calls itself
        return
    try:
        entries[name], parts = _described(thing)
    except TypeError as error:
        raise ValueError(
            f"{name or 'object'}: {type(thing).__name__} cannot be recorded ({error}); make it a "
            "dataclass, an eqx.Module, an array or a function."
        ) from None
    for part, value in parts.items():
        joined = f"{name}{part}" if part.startswith(("[", "(")) or not name else f"{name}.{part}"
        _enter(entries, joined, value, (*above, id(thing)))


@singledispatch
def _described(thing: Any) -> tuple[str, Parts]:
    """A text for what the thing is by itself, and its parts by name."""
    if hasattr(thing, "__wrapped__"):  # by jax.jit, say
        return "wrapped", {"function": thing.__wrapped__}
    kind = type(thing)
    if dataclasses.is_dataclass(kind):
        names = [field.name for field in dataclasses.fields(kind)]
    elif hasattr(thing, "__dict__"):
        names = [
            name
            for name in vars(thing)
            if not isinstance(getattr(kind, name, None), cached_property)
        ]
    elif " at 0x" in repr(thing):
        raise TypeError("its values are not seen")
    else:
        return f"{import_path(kind)} {thing!r}", {}
    return import_path(kind), _members(kind) | {name: getattr(thing, name) for name in names}


@_described.register(bool)
@_described.register(int)
@_described.register(str)
@_described.register(bytes)
@_described.register(types.NoneType)
def _plain(thing) -> tuple[str, Parts]:
    return repr(thing), {}


@_described.register(float)
@_described.register(complex)
def _number(thing, digits: int = 12) -> tuple[str, Parts]:
    return f"{thing:.{digits}g}", {}


@_described.register
def _numpy_scalar(thing: np.generic) -> tuple[str, Parts]:
    return _described(thing.item())


@_described.register(np.ndarray)
@_described.register(jax.Array)
def _array(thing) -> tuple[str, Parts]:
    if jax.dtypes.issubdtype(thing.dtype, jax.dtypes.prng_key):
        thing = jax.random.key_data(thing)
    values = np.asarray(thing)
    kind = f"{values.dtype}{list(values.shape) if values.ndim else ''}"
    if values.dtype.hasobject:
        return kind, {f"[{k}]": value for k, value in enumerate(values.ravel())}
    if values.size > _SHOWN:
        return f"{kind} #{_digest(values)}", {}
    digits = 6 if values.dtype.itemsize < 8 else 12
    shown = [f"{v:.{digits}g}" if values.dtype.kind in "fc" else repr(v)
             for v in values.ravel().tolist()]  # fmt: skip
    return f"{', '.join(shown)} ({kind})", {}


@_described.register(tuple)
@_described.register(list)
def _sequence(thing) -> tuple[str, Parts]:
    if all(isinstance(value, _PLAIN) for value in thing):
        return f"({', '.join(_described(value)[0] for value in thing)})", {}
    return f"{len(thing)} parts", {f"[{k}]": value for k, value in enumerate(thing)}


@_described.register
def _mapping(thing: Mapping) -> tuple[str, Parts]:
    return "parts", {str(name): value for name, value in thing.items()}


@_described.register(set)
@_described.register(frozenset)
def _set(thing) -> tuple[str, Parts]:
    return f"set {sorted(map(repr, thing))}", {}


@_described.register(type)
@_described.register(types.BuiltinFunctionType)
@_described.register(np.ufunc)
def _named(thing) -> tuple[str, Parts]:
    return getattr(thing, "__qualname__", None) and import_path(thing) or repr(thing), {}


@_described.register
def _dtype(thing: np.dtype) -> tuple[str, Parts]:
    return str(thing), {}


@_described.register
def _partial(thing: partial) -> tuple[str, Parts]:
    return "partial", {"function": thing.func, "arguments": thing.args, "named": thing.keywords}


@_described.register
def _method(thing: types.MethodType) -> tuple[str, Parts]:
    return "method", {"function": thing.__func__, "object": thing.__self__}


@_described.register
def _function(thing: types.FunctionType) -> tuple[str, Parts]:
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


def _members(kind: type) -> Parts:
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
    inner = [
        _code_digest(value) if isinstance(value, types.CodeType) else repr(value)
        for value in code.co_consts
    ]
    return _hash(code.co_code, repr((code.co_names, code.co_varnames, inner)).encode())


def _digest(values: np.ndarray) -> str:
    if values.dtype.kind == "f":
        bits = 36 if values.dtype.itemsize >= 8 else 18
        wide = values.astype(np.float64)
        largest = np.max(np.abs(wide), initial=0.0, where=np.isfinite(wide))
        _, exponent = np.frexp(1.3 * largest)  # 1.3: which powers of two do not tip over
        values = np.floor(np.ldexp(wide, bits - int(exponent)) + _OFFSET) + 0.0
        return _hash(b"%d" % exponent, values.tobytes())
    return _hash(values.tobytes())


def _hash(*data: bytes) -> str:
    return hashlib.sha256(b"\0".join(data)).hexdigest()[:16]
