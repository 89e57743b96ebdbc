"""A reduced model on reference points with all that it takes to run it at any parameters."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsph import Fluid, ParticleState, Schedule, SPHFunctional, Trajectory
from jaxsph.compiled import full_precision
from jaxsph.scenes import Scene
from jaxsph.shown import concrete, line, spread
from jaxsph.shown import table as shown_table

from ..dynamics.coefficients import Coefficients
from ..dynamics.log_density import to_log_density
from ..parameters.family import Training, functional_of, table
from ..parameters.laws import Between, Law
from ..parameters.through_host import through_host
from .indicator import Indicator, indicated
from .prediction import Maker, Prediction
from .reduced_flow import ReducedFlow
from .sweep import batch_of, swept
from .times import EvenTimes, GivenTimes, Times

_EDGE = 1e-6  # of a parameter's range: so much beyond is not outside
_POSITIVE = (".viscosity", ".sound_speed", ".delta", ".alpha")
_CANDIDATES = 64
_MOST_SCENES = 100  # made for the members of a prediction

Parameters = Mapping[str, Any] | Sequence[Mapping[str, Any]]


class TrainedModel(eqx.Module):
    """A reduced model of a family of scenes, as `jaxsph_rom.train` makes it.

    Operators at new parameters are those of the scene that the family's `make` gives there, and so
    is the start. Where these follow a law (`Law`) at the training points and at as many probes
    between them as it takes to test it, the law stands for `make`, in files too. Where there is
    none, `make` is asked for up to 100 members at once; for more, and in a model of a file, it is
    interpolated between the training points, which the prediction says. Traced code then takes
    its derivatives by differences (`through_host`); a start that is only known to a tolerance, as
    one that an iteration finds, has none worth the name: give `Family(make, starts=False)`.

    Args:
        flow: basis and dynamics.
        functional: of the first training scene on the reference points.
        coefficients: theta, what changes from scene to scene.
        names: of the parameters (static).
        points: training points, in their order (R, n).
        law, between: theta of the parameters, by law if there is one and between the points.
        start_law, start_between: coordinates at the start, likewise.
        indicator: of errors.
        schedule: of the training runs (static).
        scene: name of the scenes (static).
        parameters: record of the first (static).
        training: how it was trained, what that cost and what errors are left (static).
        source: the training scenes and the family; none in a model of a file (static).

    Examples:
        >>> import jaxsph, jaxsph_rom
        >>> from jaxsph.arrangements import Lattice
        >>> def make(reynolds):
        ...     return jaxsph.scenes.taylor_green(
        ...         16, reynolds, end_time=0.06, arrangement=Lattice()
        ...     )
        >>> trained = jaxsph_rom.train(make, [{"reynolds": 100.0}, {"reynolds": 200.0}], modes=2)
        >>> trained.save("model.h5")
        >>> prediction = jaxsph_rom.load("model.h5").predict({"reynolds": [100.0, 130.0, 400.0]})
        >>> prediction.coordinates.shape  # members, times, modes
        (3, 4, 2)
        >>> prediction.outside
        array([False, False,  True])
        >>> prediction.fields(1).velocity.shape  # times, points, directions
        (4, 256, 2)
    """

    flow: ReducedFlow
    functional: SPHFunctional
    coefficients: Coefficients
    names: tuple[str, ...] = eqx.field(static=True)
    points: Float[np.ndarray, "runs names"]
    law: Law | None
    between: Between
    start_law: Law | None
    start_between: Between
    indicator: Indicator
    schedule: Schedule = eqx.field(static=True)
    scene: str = eqx.field(static=True)
    parameters: dict[str, Any] = eqx.field(static=True)
    training: dict[str, Any] = eqx.field(static=True)
    source: Training | None = eqx.field(static=True, default=None)

    def _rows(self) -> dict[str, str] | None:
        if not concrete(self.points, self.flow.basis.modes):
            return None
        told = self.training
        kinds = [k for k in (told["formulation"], told["reduction"]) if k]
        if told["closure"] != "none":
            kinds.append(f"{told['closure']} closure")
        errors = [r["errors"] for r in told["runs"] if isinstance(r["errors"], dict)]
        percent = [e["velocity_median_percent"] for e in errors]
        lost = len(told["runs"]) - len(errors)
        return {
            "scene": self.scene,
            "runs": str(len(self.points)),
            **{name: f"{low:g} to {high:g}" for name, (low, high) in self.range.items()},
            "modes": f"{self.flow.basis.size} on {len(self.flow.reference.points)} points",
            "made by": ", ".join(kinds),
            "time": f"to {self.schedule.end_time:g} s",
            "error on its runs": spread(percent, "%") + (f", {lost} lost" if lost else ""),
        }

    def __repr__(self):
        return line(self, self._rows())

    def _repr_html_(self):
        return shown_table(self, self._rows())

    @property
    def range(self) -> dict[str, tuple[float, float]]:
        """Lowest and highest training value of each parameter."""
        low, high = (np.asarray(f(self.points, axis=0)) for f in (np.min, np.max))
        return {n: (float(a), float(b)) for n, a, b in zip(self.names, low, high, strict=True)}

    def predict(
        self,
        parameters: Parameters,
        *,
        start: Scene | ParticleState | Sequence[Scene | ParticleState] | None = None,
        times: Float[np.ndarray, " times"] | None = None,
        progress: Callable[[int], None] | None = None,
    ) -> Prediction:
        """Run at any parameters, all members by one sweep.

        Parameters and starts may be traced: `predict` works inside `jax.jit`, `vmap`, `grad` and
        `scan`, and then neither checks values nor reports times.

        Args:
            parameters: a dictionary, a list of dictionaries, or a dictionary of arrays.
            start: of all members, or one each; the family's own at these parameters if none is
                given.
            times: when coordinates are wanted [s]; the training runs' if none are given.
            progress: is called with the number of members done since its last call.

        Raises:
            ValueError: for names that are not the model's, values that are not finite or that
                `make` refuses, or times that do not increase from 0 on.
        """
        wanted, time = self._times(times)
        traced = _traced((parameters, start))
        points = self._traced_points(parameters) if traced else self._points(parameters)
        values, operators = self._values(points, traced)
        starts, origin = self._starts(points, start, traced)
        seconds = {}
        if traced:
            flow = self.flow
            found, code, step = batch_of(flow.system, flow.bound, wanted, starts, values)
        else:
            done = swept(self.flow, starts, values, wanted, progress=progress)
            found, code, step = done.coordinates, done.code, done.step
            seconds = {"run_seconds": done.run_seconds, "compile_seconds": done.compile_seconds}
        if isinstance(wanted, EvenTimes):
            join = jnp.concatenate if traced else np.concatenate
            found = join([starts[:, None], found], axis=1)
        return Prediction(
            names=self.names, points=points, values=values, time=time, coordinates=found,
            status=code, step=step, outside=self._outside(points, time), start=origin,
            operators=operators, maker=Maker(self), **seconds,
        )  # fmt: skip

    def fields(self, prediction: Prediction, member: int, points=None) -> Trajectory:
        """Fields of a member; see `Prediction.fields`."""
        coordinates, time = prediction.coordinates[member], prediction.time
        if not _traced((coordinates, prediction.values)):
            count = prediction.good(member)
            coordinates, time = coordinates[:count], time[:count]
        fluid = self.fluid(prediction.values[member])
        return self.flow.fields(coordinates, time, points, fluid)

    def fluid(self, values: Float[Array, " coefficients"]) -> Fluid:
        """The fluid at theta."""
        values = jnp.asarray(values, self.functional.mass.dtype)
        return self.coefficients.applied(self.functional, values).fluid

    def indicate(self, points, values, time, coordinates) -> Float[Array, " members"]:
        """The expected error of each member (`Indicator`)."""
        dtype = self.flow.reference.points.dtype
        arguments = (jnp.asarray(a, dtype) for a in (points, values, time, coordinates))
        found = indicated(self.indicator, self.flow, *arguments)
        return found if _traced((values, coordinates)) else np.asarray(found)

    def predicted_beyond(self, prediction: Prediction) -> dict[str, int]:
        """How many members are outside the training range, by parameter; those without are left
        out."""
        found = {}
        for name, (low, high) in self.range.items():
            edge = _EDGE * max(abs(low), abs(high))
            values = prediction.parameters[name]
            found[name] = int(((values < low - edge) | (values > high + edge)).sum())
        return {name: count for name, count in found.items() if count}

    def suggest(self, candidates: Parameters | None = None) -> dict[str, float]:
        """The parameters at which the expected error is largest: the next training point.

        Args:
            candidates: to choose from; random points in the training range if none are given.
        """
        if candidates is None:
            low, high = (np.asarray(f(self.points, axis=0)) for f in (np.min, np.max))
            draw = np.random.default_rng(0).uniform(size=(_CANDIDATES, len(self.names)))
            candidates = dict(zip(self.names, (low + (high - low) * draw).T, strict=True))
        prediction = self.predict(candidates)
        expected = np.where(prediction.status != 0, np.inf, prediction.error_indicator)
        worst = prediction.points[int(np.argmax(np.nan_to_num(expected, posinf=np.inf)))]
        return dict(zip(self.names, map(float, worst), strict=True))

    def save(self, path: str | os.PathLike) -> None:
        """Write the model to an HDF5 file (`save`)."""
        from ..files.model_file import save

        save(path, self)

    def _times(self, times) -> tuple[Times, Float[np.ndarray, " times"]]:
        dtype = self.flow.reference.points.dtype
        if times is None:
            return EvenTimes.of(self.schedule, dtype), self.schedule.times
        given = GivenTimes.of(times, self.schedule.time_step, dtype)
        return given, np.atleast_1d(np.asarray(times, float))

    def _points(self, parameters) -> Float[np.ndarray, "members names"]:
        names, points = table(parameters)
        self._check_names(names)
        if not len(points):
            raise ValueError("parameters: give at least one value of each.")
        return points[:, [names.index(name) for name in self.names]]

    def _traced_points(self, parameters) -> Float[Array, "members names"]:
        dtype = self.flow.reference.points.dtype
        if not isinstance(parameters, Mapping):
            return jnp.concatenate([self._traced_points(member) for member in parameters])
        self._check_names(tuple(parameters))
        columns = [jnp.atleast_1d(jnp.asarray(parameters[n], dtype)) for n in self.names]
        count = max(len(column) for column in columns)
        return jnp.stack([jnp.broadcast_to(column, count) for column in columns], axis=1)

    def _check_names(self, names: tuple[str, ...]) -> None:
        if set(names) != set(self.names):
            raise ValueError(
                f"parameters: the model's are {', '.join(self.names)}; got "
                f"{', '.join(names) or 'none'}."
            )

    def _outside(self, points, time):
        xp = jnp if _traced(points) else np
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        edge = _EDGE * np.maximum(np.abs(low), np.abs(high))
        beyond = ((points < (low - edge)[None]) | (points > (high + edge)[None])).any(axis=1)
        late = bool(time[-1] > self.schedule.end_time * (1.0 + _EDGE))
        return beyond | xp.full(beyond.shape, late)

    def _values(self, points, traced: bool):
        """theta of each member, and where it is from."""
        if self.law is not None:
            values = jax.vmap(self.law)(points) if traced else _host(self.law, points)
            if not traced:
                self._check_values(points, values)
            return values, "family"
        if self.source is None or len(points) > _MOST_SCENES:
            by = jax.vmap(self.between)(points) if traced else _host(self.between, points)
            return by, "interpolated"
        return self._by_make(self._made_values, self.coefficients.size, points, traced), "family"

    def _check_values(self, points, values) -> None:
        """What the law says, against `make` where it has been tested least."""
        for k, name in enumerate(self.coefficients.names):
            if name.endswith(_POSITIVE) and not (values[:, k] >= 0.0).all():
                worst = points[int(np.argmin(values[:, k]))]
                raise ValueError(f"parameters: {name} is negative at {self._said(worst)}.")

    def _starts(self, points, start, traced: bool):
        """Coordinates at the start of each member, and where they are from."""
        if start is not None:
            several = isinstance(start, list | tuple)
            states = [self._projected(one) for one in (start if several else [start])]
            if several and len(states) != len(points):
                raise ValueError(f"start: {len(states)} of them for {len(points)} members.")
            stacked = jnp.stack(states) if traced else np.stack(states)
            return (stacked if several else stacked.repeat(len(points), axis=0)), "given"
        if self.start_law is not None:
            law = self.start_law
            return (jax.vmap(law)(points) if traced else _host(law, points)), "family"
        asked = self.source is not None and self.source.family.starts
        if not asked or len(points) > _MOST_SCENES:
            by = self.start_between
            return (jax.vmap(by)(points) if traced else _host(by, points)), "interpolated"
        size = self.flow.system.size
        return self._by_make(self._made_start, size, points, traced), "family"

    def _by_make(self, function, size: int, points, traced: bool):
        if not traced:
            return np.stack([function(point) for point in points])
        width = np.ptp(self.points, axis=0)
        scale = np.where(width > 0.0, width, 1.0)
        return jax.vmap(lambda point: through_host(function, size, scale, point))(points)

    def _made_values(self, point) -> Float[np.ndarray, " coefficients"]:
        named = self.source.named(point)
        scene = self.source.family.scene(named, probe=True)
        functional = functional_of(scene, self.source.scenes[0], named)
        self.coefficients.check(functional, self.functional, "parameters")
        return np.asarray(self.coefficients.values(functional))

    def _made_start(self, point) -> Float[np.ndarray, " modes"]:
        return np.asarray(self._projected(self.source.family.scene(self.source.named(point))))

    def _projected(self, start: Scene | ParticleState) -> Float[Array, " modes"]:
        return projected_start(self.flow, start)

    def _said(self, point) -> str:
        return ", ".join(f"{n} = {v:g}" for n, v in zip(self.names, point, strict=True))


def projected_start(flow: ReducedFlow, start: Scene | ParticleState) -> Float[Array, " modes"]:
    """Coordinates of particles; traceable.

    Raises:
        ValueError: if it is neither a scene nor a state, or particles have clumped.
    """
    state = start.state if isinstance(start, Scene) else start
    if not isinstance(state, ParticleState):
        raise ValueError(f"start: a scene or its particles, got {type(start).__name__}.")
    traced = _traced(state)
    xp, dtype = jnp if traced else np, flow.reference.points.dtype
    position, velocity, density = (
        xp.asarray(a, dtype) for a in (state.position, state.velocity, state.density)
    )
    particles = xp.concatenate([density[:, None], velocity], axis=1)
    fields, overflow = flow.reference.compose(position, particles)
    if not _traced(overflow) and bool(overflow):
        raise ValueError("start: particles have clumped and cannot be mapped.")
    return flow.project(_with_log_density(fields, flow.fluid))


@jax.jit
def _with_log_density(fields, fluid):
    return jnp.concatenate([to_log_density(fields[:, :1], fluid), fields[:, 1:]], axis=1)


@eqx.filter_jit
@full_precision
def _all(law, points):
    return jax.vmap(law)(points)


def _host(law, points) -> np.ndarray:
    return np.asarray(_all(law, jnp.asarray(points)))


def _traced(tree) -> bool:
    return any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(tree))
