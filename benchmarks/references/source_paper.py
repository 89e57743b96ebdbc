"""What the source paper computes with its reduced models and which errors it prints.

Rodriguez et al., "Meshless projection model-order reduction via reference spaces for
smoothed-particle hydrodynamics". Discrepancies are percent on its line of probes, the peak over
time; its energies are sums of singular values, not of their squares. Its GPOD is called
`galerkin` here.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product

PROJECTIONS = ("galerkin", "apg")


@dataclass(frozen=True)
class Wanted:
    """A reduced run: of a kind, at a Reynolds number, with a number of modes and a projection."""

    kind: str
    reynolds: float
    modes: int
    projection: str

    @property
    def name(self) -> str:
        """As `--cases` takes it."""
        return f"{self.kind}-{self.reynolds:g}-{self.modes}-{self.projection}"


@dataclass(frozen=True)
class Kind:
    """Reduced models trained in one way.

    Args:
        trained_on: Reynolds numbers.
        reynolds: at which they are run.
        modes: numbers of modes.
        borders: of local bases over the Reynolds number; none for a global basis.
    """

    trained_on: tuple[float, ...]
    reynolds: tuple[float, ...]
    modes: tuple[int, ...]
    borders: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Printed:
    """Peak discrepancy [%] of velocity and of pressure, and how the paper says so in words."""

    velocity: float
    pressure: float | None
    note: str | None = None


@dataclass(frozen=True)
class PaperExperiment:
    """One of the paper's three experiments.

    Args:
        kinds: how its reduced models are trained, by name.
        printed: (kind, Re, M, projection) -> what the paper prints.
        energy: space -> number of modes -> cumulative energy [%] at `energy_reynolds`.
        at_scale: what is run at a scale, where that is not everything.
        arrangement: how particles start.
    """

    kinds: dict[str, Kind]
    printed: dict[tuple[str, float, int, str], Printed]
    energy: dict[str, dict[str, float]]
    at_scale: dict[str, dict[str, Kind]] = field(default_factory=dict)
    arrangement: str = "lattice"

    def wanted(self, kinds: dict[str, Kind], projections=PROJECTIONS) -> list[Wanted]:
        """All runs of some kinds."""
        return [
            Wanted(name, *values)
            for name, kind in kinds.items()
            for values in product(kind.reynolds, kind.modes, projections)
        ]


def _both(kind: str, reynolds: float, modes: int, printed: Printed) -> dict:
    return {(kind, reynolds, modes, projection): printed for projection in PROJECTIONS}


_FROM_FOUR = (100.0, 150.0, 200.0, 250.0)
_BORDERS = (50.0, 100.0, 150.0, 200.0)
_BELOW_10 = "pressure below 10"

EXPERIMENTS = {
    "taylor-green": PaperExperiment(
        kinds={
            "reconstructive": Kind((100.0,), (100.0,), (5, 10)),
            "predictive": Kind(_FROM_FOUR, (125.0, 175.0, 225.0), (5,)),
        },
        at_scale={
            "half": {
                "reconstructive": Kind((100.0,), (100.0,), (5, 10)),
                "predictive": Kind(_FROM_FOUR, (175.0,), (5,)),
            }
        },
        printed={
            ("reconstructive", 100.0, 5, "galerkin"): Printed(10.0, 6.0),
            ("reconstructive", 100.0, 5, "apg"): Printed(10.0, 4.0),
            ("reconstructive", 100.0, 10, "galerkin"): Printed(
                8.0, None, "velocity 7 to 8, pressure unstable"
            ),
            ("reconstructive", 100.0, 10, "apg"): Printed(8.0, 50.0, "velocity 7 to 8"),
            ("predictive", 125.0, 5, "galerkin"): Printed(10.0, 30.0),
            ("predictive", 125.0, 5, "apg"): Printed(10.0, 10.0, _BELOW_10),
            ("predictive", 175.0, 5, "galerkin"): Printed(4.0, 20.0),
            ("predictive", 175.0, 5, "apg"): Printed(4.0, 10.0, _BELOW_10),
            ("predictive", 225.0, 5, "galerkin"): Printed(8.0, 20.0),
            ("predictive", 225.0, 5, "apg"): Printed(8.0, 10.0, _BELOW_10),
        },
        energy={
            "lagrangian": {"2": 99.9, "5": 99.98, "10": 99.995},
            "reference": {"2": 99.996, "5": 99.999, "10": 99.9994},
        },
        arrangement="packed",
    ),
    "lid-driven-cavity": PaperExperiment(
        kinds={
            "reconstructive": Kind((100.0,), (100.0,), (10, 20, 30)),
            "predictive": Kind(_BORDERS, (75.0, 125.0, 175.0), (15,), _BORDERS),
        },
        at_scale={"half": {"reconstructive": Kind((100.0,), (100.0,), (20,))}},
        printed={
            **_both("reconstructive", 100.0, 10, Printed(2.0, 7.0)),
            **_both("reconstructive", 100.0, 20, Printed(1.0, 1.5, "pressure 0.8 to 1.5")),
            **_both("reconstructive", 100.0, 30, Printed(1.0, 1.5, "pressure 0.8 to 1.5")),
            **_both("predictive", 75.0, 15, Printed(2.0, 5.0, "at most")),
            **_both("predictive", 125.0, 15, Printed(2.0, 5.0, "at most")),
            **_both("predictive", 175.0, 15, Printed(2.0, 5.0, "at most")),
        },
        energy={
            "lagrangian": {"10": 99.89, "20": 99.94, "30": 99.9684},
            "reference": {"10": 99.9984, "20": 99.9988, "30": 99.9989},
        },
    ),
    "open-cavity": PaperExperiment(
        kinds={"reconstructive": Kind((2400.0,), (2400.0,), (20,))},
        printed=_both("reconstructive", 2400.0, 20, Printed(4.0, 6.0)),
        energy={"reference": {"20": 99.9984}},
    ),
}
