"""What an object holds, as names and short texts: by it kept runs are told apart.

Everything counts that changes a run: classes, settings, arrays, the code of functions and what they
close over. Numbers count to 12 digits (single precision: 6) and large arrays by a hash of values
rounded to 2^-36 (2^-18) of the largest, so that another processor's round-off makes no difference.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .code import short_hash
from .parts import described

_TOLD = 3  # differences named in a message


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
    return "#" + short_hash(repr(sorted(content(thing).items())).encode())


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


def _enter(entries: dict[str, str], name: str, thing: Any, above: tuple[int, ...]) -> None:
    if id(thing) in above:
        entries[name] = "itself"  # a function that calls itself
        return
    try:
        entries[name], parts = described(thing)
    except TypeError as error:
        raise ValueError(
            f"{name or 'object'}: {type(thing).__name__} cannot be recorded ({error}); make it a "
            "dataclass, an eqx.Module, an array or a function."
        ) from None
    for part, value in parts.items():
        joined = f"{name}{part}" if part.startswith(("[", "(")) or not name else f"{name}.{part}"
        _enter(entries, joined, value, (*above, id(thing)))
