"""A reduced model on labels, with all that it takes to run it at any parameters."""

from __future__ import annotations

import os
import time as clock
from collections.abc import Mapping, Sequence
from typing import Any, final

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsph import Schedule, Space, Trajectory
from jaxsph.compiled import full_precision
from jaxsph.shown import line
from jaxsph.shown import table as shown_table

from ..points.dynamics.energy_bound import EnergyBound
from ..points.files.model_file import read_tree, write_tree
from ..points.parameters.family import table
from ..points.parameters.laws import Between, Law
from ..points.prediction.sweep import batch_of
from ..points.prediction.times import EvenTimes, GivenTimes
from .label_basis import LabelBasis
from .label_prediction import LabelPrediction
from .label_system import LabelSystem

KIND = ("jaxsph reduced labels", 1)
_EDGE = 1e-6  # of a parameter's range: so much beyond is not outside
_POSITIVE = (".viscosity", ".sound_speed", ".delta", ".alpha")


@final
class LabelModel(eqx.Module):
    """A reduced model of a family of scenes on the particles' labels, as `train` makes it.

    Each label's displacement, velocity and density are modes over labels times coordinates; the
    first M of motion's coordinates a are moved by a `LabelSystem`, and all others follow from
    these. It is run by the full model's time loop, at a cost that does not depend on the number of
    particles.

    Args:
        motion: modes of displacement and velocity.
        density: modes of density.
        system: that moves the coordinates, and recovers the others.
        bound: on the coordinates; what goes beyond it is a fault.
        labels: where particles start (N, n) [m].
        names: of the parameters (static).
        points: training points (R, n).
        operators, starts: theta and coordinates at the start of the parameters, by a law that was
            found, or between the training points.
        space: of the scenes (static).
        schedule: of its own steps and the training runs' snapshots (static).
        scene: their name (static).
        training: how it was trained, what that cost and what errors are left (static).
    """

    motion: LabelBasis
    density: LabelBasis
    system: LabelSystem
    bound: EnergyBound
    labels: Float[np.ndarray, "particles dim"]
    names: tuple[str, ...] = eqx.field(static=True)
    points: Float[np.ndarray, "runs names"]
    operators: Law | Between
    starts: Law | Between
    space: Space = eqx.field(static=True)
    schedule: Schedule = eqx.field(static=True)
    scene: str = eqx.field(static=True)
    training: dict[str, Any] = eqx.field(static=True)

    @property
    def range(self) -> dict[str, tuple[float, float]]:
        """Lowest and highest training value of each parameter."""
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        return {n: (float(a), float(b)) for n, a, b in zip(self.names, low, high, strict=True)}

    def predict(
        self,
        parameters: Mapping[str, Any] | Sequence[Mapping[str, Any]],
        *,
        times: Float[np.ndarray, " times"] | None = None,
    ) -> LabelPrediction:
        """Run at any parameters, all members by one sweep, which runs twice, once to compile.

        Args:
            parameters: a dictionary, a list of dictionaries, or a dictionary of arrays.
            times: when coordinates are wanted [s]; the training runs' if none are given.

        Raises:
            ValueError: for names that are not the model's, values that are not finite or give a
                negative viscosity, or times that do not increase from 0 on.
        """
        names, points = table(parameters)
        if set(names) != set(self.names):
            raise ValueError(
                f"parameters: the model's are {', '.join(self.names)}; got "
                f"{', '.join(names) or 'none'}."
            )
        if not len(points):
            raise ValueError("parameters: give at least one value of each.")
        points = points[:, [names.index(name) for name in self.names]]
        dtype = self.labels.dtype
        if times is None:
            wanted, time = EvenTimes.of(self.schedule, dtype), self.schedule.times
        else:
            wanted = GivenTimes.of(times, self.schedule.time_step, dtype)
            time = np.atleast_1d(np.asarray(times, float))
        values, starts = (_at(law, points) for law in (self.operators, self.starts))
        self._check_values(points, values)
        arguments = (self.system, self.bound, wanted, jnp.asarray(starts), jnp.asarray(values))
        seconds = []
        for _ in range(2):
            before = clock.perf_counter()
            found, code, step = jax.block_until_ready(batch_of(*arguments))
            seconds.append(clock.perf_counter() - before)
        found = np.asarray(found)
        if times is None:
            begun = np.isfinite(found[:, :1]).all(axis=2, keepdims=True)  # else lost at once
            found = np.concatenate([np.where(begun, starts[:, None], np.nan), found], axis=1)
        return LabelPrediction(
            self, points, values, time, found, np.asarray(code), np.asarray(step),
            self._outside(points, time), seconds[1], max(0.0, seconds[0] - seconds[1]),
        )  # fmt: skip

    def fields(
        self,
        time: Float[np.ndarray, " times"],
        coordinates: Float[np.ndarray, "times modes"],
        values: Float[np.ndarray, " coefficients"],
    ) -> Trajectory:
        """Particles at the coordinates of some times [s], at theta."""
        others = np.asarray(_recovered(self.system, *map(jnp.asarray, (time, coordinates, values))))
        more = self.motion.size - coordinates.shape[1]
        motion = self.motion.numbers(np.concatenate([coordinates, others[:, :more]], axis=1))
        count, (particles, dim) = len(time), self.labels.shape
        way, velocity = (part.reshape(count, particles, dim) for part in np.split(motion, 2, 1))
        density = self.density.numbers(others[:, more:])
        functional = self.system.inputs.coefficients.applied(
            self.system.inputs.functional, jnp.asarray(values)
        )
        pressure = np.asarray(functional.fluid.pressure(jnp.asarray(density)))
        position = np.asarray(self.space.box.wrap(jnp.asarray(self.labels + way)))
        told = {"scene": self.scene, "labels": True}
        return Trajectory(
            np.asarray(time), position, velocity, density, pressure, coordinates, metadata=told
        )

    def save(self, path: str | os.PathLike) -> None:
        """Write the model to an HDF5 file, whole or not at all; one that is there is replaced.

        Raises:
            ValueError: if an effect, a region or a function could not be found again from the file.
            TrajectoryFileError: if the file cannot be written.
        """
        write_tree(path, KIND, self)

    def _check_values(self, points, values) -> None:
        for k, name in enumerate(self.system.inputs.coefficients.names):
            if name.endswith(_POSITIVE) and not (values[:, k] >= 0.0).all():
                worst = points[int(np.argmin(values[:, k]))]
                said = ", ".join(f"{n} = {v:g}" for n, v in zip(self.names, worst, strict=True))
                raise ValueError(f"parameters: {name} is negative at {said}.")

    def _outside(self, points, time):
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        edge = _EDGE * np.maximum(np.abs(low), np.abs(high))
        late = bool(time[-1] > self.schedule.end_time * (1.0 + _EDGE))
        return ((points < low - edge) | (points > high + edge)).any(axis=1) | late

    def _rows(self) -> dict[str, str]:
        return {
            "scene": self.scene,
            "runs": str(len(self.points)),
            **{name: f"{low:g} to {high:g}" for name, (low, high) in self.range.items()},
            "modes": f"{self.system.size} of {self.motion.size} on {len(self.labels)} labels",
            "time": f"to {self.schedule.end_time:g} s",
            "error on its runs": f"{100.0 * self.training['error']:.3g} %",
        }

    def __repr__(self):
        return line(self, self._rows())

    def _repr_html_(self):
        return shown_table(self, self._rows())


def load(path: str | os.PathLike) -> LabelModel:
    """The model in a file that `LabelModel.save` wrote.

    Raises:
        FlowFileError: if the file is not a whole file of such a model, of another schema, or needs
            double precision that JAX has not been told to use.
    """
    return read_tree(path, KIND, "`jaxsph-rom labels`", LabelModel)


@eqx.filter_jit
@full_precision
def _all(law, points):
    return jax.vmap(law)(points)


def _at(law, points) -> np.ndarray:
    return np.asarray(_all(law, jnp.asarray(points)))


@eqx.filter_jit
@full_precision
def _recovered(system, time, coordinates, values) -> Array:
    return jax.vmap(lambda t, a: system.recovered(t, a, values))(
        jnp.asarray(time, coordinates.dtype), coordinates
    )
