"""The table of hard cases, by name."""

from __future__ import annotations

from .consistent_cases import CONSISTENT
from .free_cases import FREE
from .full_cases import FULL
from .judge import Case
from .open_cases import OPEN
from .reduced_cases import REDUCED
from .reference_cases import ON_REFERENCE_POINTS
from .spoilt_cases import SPOILT


def _table(*groups: tuple[Case, ...]) -> dict[str, Case]:
    """Cases by name.

    Raises:
        ValueError: if two have the same name.
    """
    table: dict[str, Case] = {}
    for case in (case for group in groups for case in group):
        if case.name in table:
            raise ValueError(f"cases: two are named {case.name!r}; give each a name of its own.")
        table[case.name] = case
    return table


CASES = _table(FULL, CONSISTENT, FREE, OPEN, SPOILT, REDUCED, ON_REFERENCE_POINTS)
