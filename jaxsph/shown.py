"""Objects as interpreters and notebooks show them: a name, and what there is to know, in words."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

import equinox as eqx
import jax
import numpy as np


def concrete(*arrays: Any) -> bool:
    """Whether these are arrays with values, and so neither traced, nor left out by a filter."""
    return all(
        isinstance(a, np.ndarray | jax.Array) and not isinstance(a, jax.core.Tracer) for a in arrays
    )


def line(thing: eqx.Module, rows: Mapping[str, str] | None) -> str:
    """The class and its rows in a line; its structure, where it has no values to tell of."""
    if rows is None:
        return eqx.tree_pformat(thing)
    told = ", ".join(f"{name}: {value}" for name, value in rows.items())
    return f"{type(thing).__name__}({told})"


def table(thing: eqx.Module, rows: Mapping[str, str] | None) -> str:
    """The same as an HTML table, a row a line."""
    if rows is None:
        return f"<pre>{escape(eqx.tree_pformat(thing))}</pre>"
    lines = (
        f'<tr><th style="text-align: left">{escape(name)}</th>'
        f'<td style="text-align: left">{escape(value)}</td></tr>'
        for name, value in rows.items()
    )
    return f"<table><caption>{type(thing).__name__}</caption>{''.join(lines)}</table>"


def spread(values: Any, unit: str) -> str:
    """From where to where values go, without those that are not finite."""
    values = np.asarray(values)
    found = values[np.isfinite(values)]
    if not found.size:
        return "no finite values"
    low, high = f"{found.min():.4g}", f"{found.max():.4g}"
    lost = "" if found.size == values.size else f", {values.size - found.size} not finite"
    return (f"{low} {unit}" if low == high else f"{low} to {high} {unit}") + lost
