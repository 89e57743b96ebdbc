"""Scenes of any parameters."""

from __future__ import annotations

import inspect
import numbers
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from jaxsph import SPHFunctional
from jaxsph.scenes import Scene

from ..dynamics.coefficients import Coefficients
from ..dynamics.fixed_points import on_points
from .structure import difference

_SPREAD = 0.25  # of a parameter: how far probes go where there is one training point


class Family:
    """`make(**parameters)` and what is known of it.

    Args:
        make: a scene of named parameters.
        starts: whether its scenes start as their full runs do; if not, as where those settle
            first, starts are interpolated between the training runs.
        probe: stands for `make` where a scene is only looked at, if that is dear to call.

    Raises:
        ValueError: if `make` cannot be called.
    """

    def __init__(
        self,
        make: Callable[..., Scene],
        starts: bool = True,
        probe: Callable[..., Scene] | None = None,
    ):
        if not callable(make):
            raise ValueError(
                f"make: a function of named parameters that gives a scene, got {make!r}."
            )
        self.make, self.starts = make, starts
        self.probe = make if probe is None else probe

    def scene(self, parameters: Mapping[str, float], probe: bool = False) -> Scene:
        """The scene of these parameters, or one to look at only.

        Raises:
            ValueError: if `make` does not take them, or gives something else.
        """
        try:
            inspect.signature(self.make).bind(**parameters)
        except TypeError as error:
            raise ValueError(
                f"parameters: make does not take {', '.join(parameters)} ({error}); name its "
                "arguments."
            ) from None
        scene = (self.probe if probe else self.make)(**parameters)
        if not isinstance(scene, Scene):
            raise ValueError(f"make: gives {type(scene).__name__}, not a Scene; return one.")
        return scene


class Training:
    """Scenes to train on, alike but for what their parameters change.

    Args:
        family: of the scenes.
        parameters: a training point each.
        needed: scenes that are looked at; those beyond the training points are probes at random
            points between these, and no full run is made of them.

    Raises:
        ValueError: if scenes differ in their structure; it names where.
    """

    def __init__(
        self, family: Family, parameters: Sequence[Mapping[str, Any]], needed: int | None = None
    ):
        self.family = family
        self.names, self.points = table(parameters)
        if not self.names:
            raise ValueError("parameters: name at least one, as {'viscosity': 0.01}.")
        if len(np.unique(self.points, axis=0)) < len(self.points):
            raise ValueError("parameters: two training points are the same; leave one out.")
        self.scenes = [family.scene(self.named(point)) for point in self.points]
        for point, scene in zip(self.points[1:], self.scenes[1:], strict=True):
            refuse_unlike(self.scenes[0], scene, self.named(point))
        count = len(self.names)
        wanted = 3 + (count + 1) * (count + 2) // 2 if needed is None else needed
        self.probed, probes = self._probes(wanted - len(self.points))
        self.functionals = [on_points(scene) for scene in (*self.scenes, *probes)]
        self.probes = probes
        self.coefficients = Coefficients.between(self.functionals)
        self._check()
        self.values = np.stack([np.asarray(self.coefficients.values(f)) for f in self.functionals])

    def named(self, point: Float[np.ndarray, " names"]) -> dict[str, float]:
        """A point as parameters."""
        return dict(zip(self.names, map(float, point), strict=True))

    @property
    def known(self) -> Float[np.ndarray, "scenes names"]:
        """Points of the training scenes and of the probes."""
        return np.concatenate([self.points, self.probed])

    def _probes(self, count: int) -> tuple[Float[np.ndarray, "probes names"], list[Scene]]:
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        width = np.where(high > low, high - low, _SPREAD * np.abs(low))
        draw, points, scenes = np.random.default_rng(0), [], []
        for point in low + width * draw.uniform(0.05, 0.95, (max(count, 0), len(low))):
            try:
                scene = self.family.scene(self.named(point), probe=True)
                refuse_unlike(self.scenes[0], scene, self.named(point), run=False)
            except ValueError:  # of a scene that nobody has asked for
                continue
            points.append(point)
            scenes.append(scene)
        return np.asarray(points).reshape(-1, len(low)), scenes

    def _check(self) -> None:
        for part in self.coefficients.parts:
            for place in part.places:
                fixed = next((name for name in _FIXED if place.startswith(name)), None)
                if fixed is not None:
                    raise ValueError(
                        f"parameters: the training scenes differ in {place.lstrip('.')}; one "
                        "reduced model has one of it."
                    )


_FIXED = (".fluid.reference_density", ".mass", ".walls.position", ".walls.normal", ".walls.bodies")


def refuse_unlike(
    first: Scene, scene: Scene, parameters: Mapping[str, float], run: bool = True
) -> None:
    """A ValueError if two scenes differ in what no reduced model can follow.

    Args:
        first, scene: to compare.
        parameters: of the second.
        run: whether a full run is made of it, whose particles and steps count as well.
    """
    mine, theirs = (
        {"particles": len(s.state.position), "time_step": s.time_step, "end_time": s.end_time,
         "steps_per_snapshot": s.steps_per_snapshot}
        for s in (first, scene)
    )  # fmt: skip
    place = next((name for name in mine if run and mine[name] != theirs[name]), None)
    what = "" if place is None else f": {mine[place]} and {theirs[place]}"
    if place is None and first.state.position.dtype != scene.state.position.dtype:
        place = "dtype"
    for name, free in (("space", False), ("effects", True), ("fluid", True), ("walls", True)):
        if place is None:
            place = difference(getattr(first, name), getattr(scene, name), name, free)
    if place is not None:
        given = ", ".join(f"{name} = {value:g}" for name, value in parameters.items())
        raise ValueError(
            f"make: the scene of {given} differs from the first in its {place}{what}; make "
            "training scenes alike but for arrays of their effects, fluid and walls' velocity."
        )


def table(
    parameters: Mapping[str, Any] | Sequence[Mapping[str, Any]],
) -> tuple[tuple[str, ...], Float[np.ndarray, "members names"]]:
    """Names, and a row of numbers for each member.

    Args:
        parameters: a dictionary of numbers or of arrays, or a list of dictionaries of numbers.

    Raises:
        ValueError: if names differ from member to member, or a value is no finite number.
    """
    if isinstance(parameters, Mapping):
        names = tuple(parameters)
        columns = [np.atleast_1d(_numbers(name, parameters[name])) for name in names]
        count = max((len(column) for column in columns), default=0)
        if any(len(column) not in (1, count) for column in columns):
            lengths = ", ".join(f"{n} {len(c)}" for n, c in zip(names, columns, strict=True))
            raise ValueError(f"parameters: give as many values of each, got {lengths}.")
        rows = [np.broadcast_to(column, count) for column in columns]
        return names, np.stack(rows, axis=1) if rows else np.zeros((0, 0))
    if isinstance(parameters, str) or not isinstance(parameters, Iterable):
        raise ValueError(f"parameters: dictionaries of names and numbers, got {parameters!r}.")
    members = list(parameters)
    if not members:
        raise ValueError("parameters: give at least one dictionary of them.")
    names = tuple(members[0]) if isinstance(members[0], Mapping) else None
    for member in members:
        if names is None or not isinstance(member, Mapping) or set(member) != set(names):
            raise ValueError(
                f"parameters: dictionaries of the same names, got {members[0]} and {member}."
            )
        for name, value in member.items():
            if np.ndim(value) or not isinstance(value, numbers.Real | np.ndarray | np.generic):
                _numbers(name, value)
                if np.ndim(value):
                    raise ValueError(f"parameters: {name} is one number a member, got {value}.")
    rows = [[float(_numbers(name, member[name])) for name in names] for member in members]
    return names, np.asarray(rows, float).reshape(len(members), len(names))


def _numbers(name: str, value: Any) -> Float[np.ndarray, "*members"]:
    try:
        found = np.asarray(value, float)
    except (TypeError, ValueError):
        raise ValueError(f"parameters: {name} must be a number, got {value!r}.") from None
    if not np.isfinite(found).all() or found.ndim > 1:
        raise ValueError(f"parameters: {name} must be finite numbers, got {value!r}.")
    return found


def functional_of(scene: Scene, first: Scene, parameters: Mapping[str, float]) -> SPHFunctional:
    """A scene's functional on points; a ValueError if its structure is another than the first's."""
    refuse_unlike(first, scene, parameters, run=False)
    return on_points(scene)
