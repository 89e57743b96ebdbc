"""A bar that shows how far a run has come."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from tqdm import tqdm


def progress_bar(total: int, unit: str, done: int = 0) -> tqdm:
    """A bar on stderr with the estimated time left, seldom redrawn where that is a log file."""
    interval = 0.1 if sys.stderr.isatty() else 10.0
    return tqdm(total=total, initial=done, unit=unit, file=sys.stderr, mininterval=interval)


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
