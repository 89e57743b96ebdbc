"""What a comparison comes to, in words: how much faster, how wrong, and when it has paid."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence

from .case import Case

_AS_NONE = 100.0  # percent in the median over time: zero everywhere is wrong by as much


def verdict(cases: Sequence[Case]) -> list[str]:
    """A sentence or two for each kind of model, of its number of modes that errs least.

    Errors are the largest over time and over the Reynolds numbers that were predicted, or over all
    where none was; the time is the median of their ratios. A model has paid for itself after

        K = (T_training + T_offline) / (t_full - t_reduced), rounded up,

    runs, with the mean times of a run and those of the training runs and of what is made of them.

    Args:
        cases: in any order.
    """
    return [_sentence(best(group)) for group in _groups(cases, _kind)]


def best(cases: Sequence[Case]) -> list[Case]:
    """Those of the model that errs least in velocity; a model with a failed run errs most."""
    models = _groups(cases, lambda case: (*_kind(case), case.modes, tuple(case.trained_on)))
    return min(models, key=lambda model: (not _sound(model), _worst(model, "velocity_peak")))


def _groups(cases: Sequence[Case], key) -> list[list[Case]]:
    found: dict[tuple, list[Case]] = {}
    for case in cases:
        found.setdefault(key(case), []).append(case)
    return list(found.values())


def _kind(case: Case) -> tuple:
    return case.hyper, case.projection, case.memory


def _judged(model: Sequence[Case]) -> Sequence[Case]:
    """Cases that the training has not seen, or all."""
    return [case for case in model if case.predicted] or model


def _sound(model: Sequence[Case]) -> bool:
    return all(case.sound for case in _judged(model))


def _worst(model: Sequence[Case], name: str) -> float:
    values = [getattr(case, f"{name}_percent") for case in _judged(model)]
    return max((v for v in values if v is not None and math.isfinite(v)), default=math.inf)


def _sentence(model: Sequence[Case]) -> str:
    judged = _judged(model)
    numbers = ", ".join(f"{case.reynolds:g}" for case in judged)
    told = f"{_name(model[0])}, M = {model[0].modes}, at Re {numbers}: "
    if not _sound(model):
        failed = ", ".join(f"{case.reynolds:g}" for case in judged if not case.sound)
        return f"{told}no sound run at Re {failed}."
    errors = [_within(judged, name) for name in ("velocity", "pressure")]
    ratios = [case.time_ratio for case in judged if case.time_ratio is not None]
    if not ratios:
        return f"{told}{', '.join(errors)}; its time was not measured."
    ratio = statistics.median(ratios)
    times = f"{_rounded(ratio)} times faster" if ratio >= 1.0 else f"{1 / ratio:.2g} times slower"
    return f"{told}{times} than the full model, {', '.join(errors)}. {_paid(model)}"


def _within(judged: Sequence[Case], name: str) -> str:
    if name == "pressure" and all(case.uniform_pressure for case in judged):
        worst = max(case.pressure_peak_pascal for case in judged)
        return f"no pressure to compare with (off by {worst:.2g} Pa)"
    peak, median = (_worst(judged, f"{name}_{of}") for of in ("peak", "median"))
    told = f"{name} within {_rounded(peak)} % ({_rounded(median)} % in the median over time)"
    return f"{told}, no better than none" if median >= _AS_NONE else told


def _name(case: Case) -> str:
    if case.hyper == "none":
        return f"On moving particles, {case.projection}"
    return f"On points, {case.hyper}"


def _paid(model: Sequence[Case]) -> str:
    """What making it took, and after how many runs that has paid."""
    judged, case = _judged(model), model[0]
    saved = [c.fom_seconds - c.rom_seconds for c in judged if c.time_ratio is not None]
    mean = statistics.mean(saved)
    if mean <= 0.0:
        return "It is not for speed: it never pays back its training."
    if case.training_seconds is None or case.offline_seconds is None:
        return "What making it took was not measured."
    cost = case.training_seconds + case.offline_seconds
    runs = math.ceil(cost / mean)
    return (
        f"Making it took {cost:.3g} s, {case.training_seconds:.3g} s of them full runs: paid back "
        f"after {runs} run{'s' * (runs != 1)}."
    )


def _rounded(ratio: float) -> str:
    """Two digits, thousands apart."""
    return f"{ratio:.2g}" if ratio < 100.0 else f"{float(f'{ratio:.2g}'):,.0f}"
