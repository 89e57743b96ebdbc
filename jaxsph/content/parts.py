"""What a thing is by itself, as a short text, and what its parts are."""

from __future__ import annotations

import dataclasses
import types
from collections.abc import Mapping
from functools import cached_property, partial, singledispatch
from typing import Any

import jax
import numpy as np

from .code import PLAIN, function_parts, import_path, members, short_hash

Parts = Mapping[str, Any]

# metadata of a field that a class has got later: unset it is no part, so that older records hold
WHERE_SET = {"content": "where set"}
_SHOWN = 8  # values of an array that are written out
_OFFSET = 0.377  # of the rounding, so that binary fractions are not on its borders


@singledispatch
def described(thing: Any) -> tuple[str, Parts]:
    """A text for what the thing is by itself, and its parts by name."""
    if hasattr(thing, "__wrapped__"):  # by jax.jit, say
        return "wrapped", {"function": thing.__wrapped__}
    kind = type(thing)
    if dataclasses.is_dataclass(kind):
        fields = [field for field in dataclasses.fields(kind) if field.compare]
        names = [field.name for field in fields if _counts(field, thing)]
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
    return import_path(kind), members(kind) | {name: getattr(thing, name) for name in names}


def _counts(field: dataclasses.Field, thing: Any) -> bool:
    late = WHERE_SET.items() <= dict(field.metadata).items()
    return not late or getattr(thing, field.name) is not None


@described.register(bool)
@described.register(int)
@described.register(str)
@described.register(bytes)
@described.register(types.NoneType)
def _plain(thing) -> tuple[str, Parts]:
    return repr(thing), {}


@described.register(float)
@described.register(complex)
def _number(thing, digits: int = 12) -> tuple[str, Parts]:
    return f"{thing:.{digits}g}", {}


@described.register
def _numpy_scalar(thing: np.generic) -> tuple[str, Parts]:
    return described(thing.item())


@described.register(np.ndarray)
@described.register(jax.Array)
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


@described.register(tuple)
@described.register(list)
def _sequence(thing) -> tuple[str, Parts]:
    if all(isinstance(value, PLAIN) for value in thing):
        return f"({', '.join(described(value)[0] for value in thing)})", {}
    return f"{len(thing)} parts", {f"[{k}]": value for k, value in enumerate(thing)}


@described.register
def _mapping(thing: Mapping) -> tuple[str, Parts]:
    return "parts", {str(name): value for name, value in thing.items()}


@described.register(set)
@described.register(frozenset)
def _set(thing) -> tuple[str, Parts]:
    return f"set {sorted(map(repr, thing))}", {}


@described.register(type)
@described.register(types.BuiltinFunctionType)
@described.register(np.ufunc)
def _named(thing) -> tuple[str, Parts]:
    return getattr(thing, "__qualname__", None) and import_path(thing) or repr(thing), {}


@described.register
def _dtype(thing: np.dtype) -> tuple[str, Parts]:
    return str(thing), {}


@described.register
def _partial(thing: partial) -> tuple[str, Parts]:
    return "partial", {"function": thing.func, "arguments": thing.args, "named": thing.keywords}


@described.register
def _method(thing: types.MethodType) -> tuple[str, Parts]:
    return "method", {"function": thing.__func__, "object": thing.__self__}


@described.register
def _function(thing: types.FunctionType) -> tuple[str, Parts]:
    return function_parts(thing)


def _digest(values: np.ndarray) -> str:
    if values.dtype.kind == "f":
        bits = 36 if values.dtype.itemsize >= 8 else 18
        wide = values.astype(np.float64)
        largest = np.max(np.abs(wide), initial=0.0, where=np.isfinite(wide))
        _, exponent = np.frexp(1.3 * largest)  # 1.3: which powers of two do not tip over
        values = np.floor(np.ldexp(wide, bits - int(exponent)) + _OFFSET) + 0.0
        return short_hash(b"%d" % exponent, values.tobytes())
    return short_hash(values.tobytes())
