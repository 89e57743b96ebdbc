"""What is run: one thing at a time around a base, and a grid of resolution, h/dx and step."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product
from typing import Any

FULL, MOVING, TENSOR, SAMPLED = "full", "on moving particles", "tensor", "sampled"
FAMILIES = (FULL, MOVING, TENSOR, SAMPLED)


@dataclass(frozen=True)
class Case:
    """The flow that all settings of a scene compute, and against what.

    Args:
        reynolds: that is run at.
        trained_on: Reynolds numbers of the reduced models' training runs.
        end_time: [s].
        judged_from: time from which on errors count [s].
        reference: what errors are taken against, in words.
        steady: whether that does not change in time, so that a mean pressure is compared.
    """

    reynolds: float
    trained_on: tuple[float, ...]
    end_time: float
    judged_from: float
    reference: str
    steady: bool = False


@dataclass(frozen=True)
class FullSetting:
    """A full model.

    Args:
        step: dt over its stability limit.
        delta: of the density diffusion; 0 leaves it out.
        start: `quiet` (stirred particles at a balanced pressure) or `packed`; `rest` in a cavity.
        scheme: by its name; `delta` and `shifting` are those of `delta-plus`.
    """

    resolution: int = 64
    h_over_dx: float = 2.0
    step: float = 0.95
    kernel: str = "WendlandC2"
    precision: str = "float64"
    delta: float = 0.1
    shifting: bool = True
    mach: float = 0.1
    start: str = "quiet"
    scheme: str = "delta-plus"

    @property
    def family(self) -> str:
        return FULL


@dataclass(frozen=True)
class ReducedSetting:
    """A reduced model; words are those of `jaxsph-rom run`, and `hyper` may be a sampling too.

    `resolution`, `h_over_dx`, `step` and `start` are those of the training runs.
    """

    modes: int
    hyper: str = "none"
    product: str = "energy"
    projection: str = "galerkin"
    tau: float | str | None = None
    advection: str = "paper"
    map: str = "shepard"
    interpolation: str = "splines"
    spline_order: int = 3
    formulation: str = "compressible"
    closure: str = "none"
    samples: int | None = None
    resolution: int = 64
    h_over_dx: float = 2.0
    step: float = 0.95
    start: str = "quiet"

    @property
    def family(self) -> str:
        return {"none": MOVING, "tensor": TENSOR}.get(self.hyper, SAMPLED)

    @property
    def training(self) -> FullSetting:
        """The full model that it is trained on."""
        return FullSetting(self.resolution, self.h_over_dx, self.step, start=self.start)


Setting = FullSetting | ReducedSetting


@dataclass(frozen=True)
class Grid:
    """A scene's case and the settings that are run."""

    case: Case
    settings: tuple[Setting, ...]


def varied(base: Setting, **choices: Iterable[Any]) -> list[Setting]:
    """The base, and for each value of each field the base with that field changed."""
    changed = [
        dataclasses.replace(base, **{name: value})
        for name, values in choices.items()
        for value in values
    ]
    return [base, *changed]


def crossed(base: Setting, **choices: Iterable[Any]) -> list[Setting]:
    """The base with all combinations of values of some fields."""
    return [
        dataclasses.replace(base, **dict(zip(choices, values, strict=True)))
        for values in product(*choices.values())
    ]


def named(setting: Setting) -> str:
    """A setting in a few words: what differs from the defaults, and always the resolution."""
    defaults = {field.name: field.default for field in dataclasses.fields(setting)}
    values = {
        name: value
        for name, value in dataclasses.asdict(setting).items()
        if name not in ("resolution", "modes", "start") and value != defaults[name]
    }
    words = {
        "h_over_dx": "h = {:g} dx", "step": "step {:g}", "delta": "delta {:g}",
        "mach": "Ma {:g}", "samples": "{} samples", "spline_order": "order {}",
        "closure": "{} closure", "map": "{} map",
    }  # fmt: skip
    parts = []
    for name, value in values.items():
        if name == "shifting":
            parts.append("no shifting")
        elif name == "delta" and value == 0.0:
            parts.append("no diffusion")
        elif name == "tau":
            parts.append(f"tau {value:g} s" if isinstance(value, float) else f"tau {value}")
        elif not (name == "hyper" and value == TENSOR):
            parts.append(words.get(name, "{}").format(value))
    if setting.start == "packed":
        parts.append("packed")
    side = f"{setting.resolution}²"
    modes = getattr(setting, "modes", None)
    return ", ".join([side if modes is None else f"M = {modes}, {side}", *parts])


def _distinct(*groups: Iterable[Setting]) -> tuple[Setting, ...]:
    return tuple(dict.fromkeys(setting for group in groups for setting in group))


_VORTEX = Case(175.0, (100.0, 150.0, 200.0, 250.0), 1.0, 0.0, "the exact solution")
_CAVITY = Case(
    100.0, (75.0, 125.0), 12.0, 11.0, "a converged spectral solution of the steady flow", True
)


def _vortex() -> Grid:
    base, moving = FullSetting(), ReducedSetting(3)
    better = FullSetting(scheme="consistent")
    tensor, sampled = ReducedSetting(5, "tensor"), ReducedSetting(5, "q-deim", samples=20)
    closed = ReducedSetting(5, "tensor", closure="linear")
    return Grid(
        _VORTEX,
        _distinct(
            crossed(base, resolution=(16, 24, 32, 48, 64, 96, 128)),
            crossed(base, resolution=(32, 64, 128), step=(0.5,)),
            crossed(base, resolution=(32, 64), h_over_dx=(1.5, 3.0)),
            crossed(base, resolution=(32, 48, 64), h_over_dx=(4.0,)),
            crossed(base, resolution=(64,), h_over_dx=(4.0,), step=(0.5,)),
            varied(base, step=(0.25,), kernel=("WendlandC4", "QuinticSpline"),
                   precision=("float32",), delta=(0.0, 0.05, 0.2), shifting=(False,),
                   mach=(0.05, 0.2), start=("packed",)),
            crossed(base, resolution=(128,), precision=("float32",)),
            crossed(better, resolution=(16, 24, 32, 48, 64, 96)),
            varied(better, h_over_dx=(1.5, 3.0, 4.0), kernel=("WendlandC4", "QuinticSpline"),
                   precision=("float32",), mach=(0.05,), step=(0.5,), start=("packed",)),
            varied(tensor, modes=(2, 3, 10, 20), product=("euclidean",),
                   formulation=("solenoidal",), resolution=(32, 96), closure=("linear",)),
            varied(closed, modes=(10,)),
            varied(sampled, samples=(10, 50), hyper=("non-negative",), modes=(10,)),
            varied(moving, modes=(2, 5, 10), product=("euclidean",), map=("mls",),
                   advection=("consistent",), spline_order=(2,), resolution=(32,)),
            crossed(moving, projection=("apg",), tau=(1e-4, 1e-2, "convective")),
        ),
    )  # fmt: skip


def _cavity() -> Grid:
    base = FullSetting(32, start="rest")
    better = dataclasses.replace(base, scheme="consistent")
    moving = ReducedSetting(5, resolution=32, start="rest")
    tensor = dataclasses.replace(moving, modes=10, hyper="tensor", formulation="solenoidal")
    sound = dataclasses.replace(tensor, formulation="compressible")
    sampled = dataclasses.replace(sound, hyper="q-deim", samples=20)
    return Grid(
        _CAVITY,
        _distinct(
            crossed(base, resolution=(16, 24, 32, 40, 50, 64)),
            crossed(base, resolution=(24, 32), step=(0.5,)),
            crossed(base, resolution=(24, 32), h_over_dx=(1.5, 3.0)),
            varied(base, kernel=("WendlandC4", "QuinticSpline"), precision=("float32",),
                   delta=(0.0, 0.2), shifting=(False,), mach=(0.2,)),
            crossed(better, resolution=(16, 24, 32, 40, 50)),
            varied(better, h_over_dx=(1.5, 3.0), kernel=("WendlandC4", "QuinticSpline"),
                   precision=("float32",)),
            varied(tensor, modes=(5, 15), resolution=(50,)),
            varied(sound, modes=(5,), product=("euclidean",), closure=("linear",)),
            varied(sampled, hyper=("non-negative",)),
            varied(moving, modes=(10,), product=("euclidean",), map=("mls",),
                   advection=("consistent",), interpolation=("polynomials",)),
            crossed(moving, projection=("apg",), tau=(1e-4, "convective")),
        ),
    )  # fmt: skip


def _exact(reynolds: float, end_time: float) -> Grid:
    """A flow between walls whose solution is known, from a lattice, full models only."""
    base = FullSetting(25, start="rest")
    settings = [
        setting
        for scheme in ("delta-plus", "consistent")
        for own in [dataclasses.replace(base, scheme=scheme)]
        for setting in (
            *crossed(own, resolution=(12, 25, 50)),
            *varied(own, h_over_dx=(1.5, 3.0), precision=("float32",)),
        )
    ]
    case = Case(reynolds, (), end_time, 0.1 * end_time, "the exact solution")
    return Grid(case, _distinct(settings))


def _quick_vortex() -> Grid:
    base = FullSetting(24)
    moving = ReducedSetting(2, resolution=24)
    tensor = dataclasses.replace(moving, modes=3, hyper="tensor")
    case = dataclasses.replace(_VORTEX, trained_on=(150.0, 200.0), end_time=0.25)
    return Grid(
        case,
        _distinct(
            crossed(base, resolution=(16, 24, 32)),
            varied(base, precision=("float32",), shifting=(False,)),
            varied(tensor, modes=(2,)),
            [dataclasses.replace(tensor, hyper="q-deim", samples=10), moving],
        ),
    )


def _quick_cavity() -> Grid:
    base = FullSetting(16, start="rest")
    moving = ReducedSetting(3, resolution=16, start="rest")
    tensor = dataclasses.replace(moving, modes=5, hyper="tensor", formulation="solenoidal")
    case = dataclasses.replace(_CAVITY, end_time=6.0, judged_from=5.0)
    settings = (crossed(base, resolution=(12, 16, 24)), varied(tensor, modes=(3,)), [moving])
    return Grid(case, _distinct(*settings))


GRIDS = {
    "taylor-green": _vortex(),
    "lid-driven-cavity": _cavity(),
    "poiseuille": _exact(10.0, 2.0),
    "couette": _exact(10.0, 2.0),
    "hydrostatic-tank": _exact(100.0, 10.0),
}
QUICK = {"taylor-green": _quick_vortex(), "lid-driven-cavity": _quick_cavity()}
