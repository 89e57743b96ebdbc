"""Local bases: one for each interval of the parameter, chosen at prediction."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import final

from .method import Experiment


@final
@dataclass(frozen=True)
class LocalBases:
    """Intervals of a parameter, each with a basis of its own (paper, lid-driven cavity).

    Borders b_0 < b_1 < ... < b_K make the intervals

        [b_0, b_1), [b_1, b_2), ..., [b_{K-1}, b_K]

    from which a prediction takes its basis. A basis is trained on the closed interval
    [b_i, b_{i+1}], so a run at a border trains the bases on both sides. The paper's borders of the
    Reynolds number are (50, 100, 150, 200). A study with local bases is an experiment an interval.

    Args:
        borders: increasing, at least two, in the parameter's unit.

    Raises:
        ValueError: if the borders are too few or do not increase.

    Examples:
        >>> from jaxsph_rom import LocalBases
        >>> bases = LocalBases((50.0, 100.0, 150.0))
        >>> for experiment in bases.experiments((50.0, 100.0, 150.0), (75.0, 125.0), modes=(10,)):
        ...     print(experiment.trained_on, experiment.reynolds)
        (50.0, 100.0) (75.0,)
        (100.0, 150.0) (125.0,)
    """

    borders: tuple[float, ...]

    def __post_init__(self):
        increasing = all(a < b for a, b in pairwise(self.borders))
        if len(self.borders) < 2 or not increasing:
            raise ValueError(
                f"borders: got {_listed(self.borders)}; give two or more in increasing order."
            )

    def interval(self, parameter: float) -> int:
        """The number of the interval, from 0, whose basis predicts at the parameter.

        Raises:
            ValueError: if no interval holds it.
        """
        first, last = self.borders[0], self.borders[-1]
        if not first <= parameter <= last:  # so NaN is refused, too
            raise ValueError(
                f"parameter: {parameter:.12g} is outside [{first:g}, {last:g}], which the local "
                "bases cover; stay inside or extend the borders."
            )
        return min(bisect_right(self.borders, parameter), len(self.borders) - 1) - 1

    def training(self, values: Iterable[float]) -> tuple[tuple[float, ...], ...]:
        """For each interval the parameter values that train its basis, in the order given.

        Raises:
            ValueError: if a value is outside all intervals, or an interval has none.
        """
        values = self._covered(values)
        return tuple(self._closed(number, values) for number in range(len(self.borders) - 1))

    def experiments(
        self, trained_on: Iterable[float], reynolds: Iterable[float], modes: tuple[int, ...]
    ) -> tuple[Experiment, ...]:
        """The experiment of each interval that holds a Reynolds number to run, in their order.

        Raises:
            ValueError: if a Reynolds number is outside all intervals, or such an interval has no
                training run.
        """
        trained_on, reynolds = self._covered(trained_on), self._covered(reynolds)
        numbers = [self.interval(value) for value in reynolds]
        return tuple(
            Experiment(
                self._closed(number, trained_on),
                tuple(v for v, at in zip(reynolds, numbers, strict=True) if at == number),
                modes,
            )
            for number in sorted(set(numbers))
        )

    def _covered(self, values: Iterable[float]) -> tuple[float, ...]:
        values = tuple(values)
        for value in values:
            self.interval(value)
        return values

    def _closed(self, number: int, values: tuple[float, ...]) -> tuple[float, ...]:
        low, high = self.borders[number : number + 2]
        inside = tuple(value for value in values if low <= value <= high)
        if not inside:
            raise ValueError(
                f"training: none of {_listed(values)} is in [{low:g}, {high:g}]; "
                "add a training run there or merge the interval with the next."
            )
        return inside


def _listed(values: tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"
