"""A bar that shows how far a run has come."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import final

from tqdm import tqdm

COMPILING = "compiling"
_AT_FIRST = 1e-3  # seconds in which bad input is met, so that its line stands alone


@final
class _Bar(tqdm):
    """A bar that says that the program is being compiled, until the first steps are done."""

    def update(self, n=1):
        if self.postfix == COMPILING:
            self.set_postfix_str("", refresh=False)
        return super().update(n)

    def __exit__(self, kind, *rest):
        if kind is None:
            self.delay = 0.0  # a short run is shown at its end
        return super().__exit__(kind, *rest)


def progress_bar(total: int, unit: str, done: int = 0, label: str | None = None) -> tqdm:
    """A bar on stderr with the estimated time left, seldom redrawn where that is a log file."""
    interval, compiles = 0.1 if sys.stderr.isatty() else 10.0, unit in ("step", "run")
    bar = _Bar(
        total=total, initial=done, unit=unit, desc=label, file=sys.stderr, mininterval=interval,
        delay=0.0 if compiles else _AT_FIRST,
    )  # fmt: skip
    if compiles:
        bar.set_postfix_str(COMPILING)
    return bar


@contextmanager
def shown_steps(
    progress: bool | Callable[[int], None] | None, total: int, done: int = 0
) -> Iterator[Callable[[int], None] | None]:
    """What is told of steps as they are done: a bar for True, what is given, or nothing."""
    if progress is True:
        with progress_bar(total, "step", done) as bar:
            yield bar.update
    else:
        yield progress or None
