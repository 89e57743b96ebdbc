"""What closure a reduced model shall learn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final


@final
@dataclass(frozen=True)
class LinearClosure:
    """That a trained flow shall have a linear closure, as `fit_linear_closure` makes it.

    Args:
        held_back: parameters of a training run that only judges, if there is one.
        window: intervals between snapshots in a window, if runs are so long.
        iterations: of the training.
        learning_rate: at the start.
    """

    held_back: Mapping[str, float] | None = None
    window: int = 50
    iterations: int = 600
    learning_rate: float = 0.02

    def __post_init__(self):
        if self.window < 1 or self.iterations < 1:
            raise ValueError(
                f"closure: window and iterations must be at least 1, got {self.window} and "
                f"{self.iterations}."
            )
        if not self.learning_rate > 0.0:
            raise ValueError(
                f"closure: the learning rate must be positive, got {self.learning_rate}."
            )


def held_back(parameters: Sequence[Mapping[str, float]]) -> Mapping[str, float] | None:
    """The training run that had best judge a closure: an inner one of four or more of one
    parameter, else none."""
    if len(parameters) < 4 or len(parameters[0]) != 1:
        return None
    (name,) = parameters[0]
    return sorted(parameters, key=lambda p: p[name])[-2]
