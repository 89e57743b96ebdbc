"""Figures by which runs are judged."""

from __future__ import annotations

from typing import TYPE_CHECKING

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .interpolation import KernelMap, ShepardMap
from .pairs import Space
from .trajectory import Trajectory

if TYPE_CHECKING:
    from .scenes import Scene


def kinetic_energy(velocity: Float[Array, "*times particles dim"], mass) -> Array:
    """sum_i m |u_i|^2 / 2 [J], over the last two axes."""
    return 0.5 * mass * (velocity**2).sum(axis=(-2, -1))


def relative_discrepancy(
    reference: Float[np.ndarray, "times probes"], values: Float[np.ndarray, "times probes"]
) -> Float[np.ndarray, " times"]:
    """Percent relative discrepancy at each time (paper, eq. PRD):

        100 mean_i |c_i - c~_i| / (max_i c_i - min_i c_i),

    c_i the reference and c~_i the values at probe i; 0 where both are the same constant, as at the
    start from rest.

    Examples:
        >>> import numpy as np
        >>> from jaxsph.metrics import relative_discrepancy
        >>> reference = np.array([[0.0, 1.0, 2.0]])  # one time, three probes
        >>> relative_discrepancy(reference, reference + 0.02).round(3)
        array([1.])
    """
    reference, values = np.asarray(reference), np.asarray(values)
    spread = reference.max(axis=1) - reference.min(axis=1)
    apart = np.abs(reference - values).mean(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(apart == 0.0, 0.0, 100.0 * apart / spread)


def phase_error(
    time: Float[np.ndarray, " times"],
    reference: Float[np.ndarray, "times probes"],
    values: Float[np.ndarray, "times probes"],
) -> tuple[float, float]:
    """By how much an oscillation on probes is ahead [degrees], and its frequency [Hz].

    The angle of the cross-spectrum, summed over the probes and windowed (Hann), at the frequency
    where the reference has most power.

    Raises:
        ValueError: for fewer than four evenly spaced times, or a reference that does not oscillate.
    """
    every = np.diff(time)
    if len(time) < 4 or not np.allclose(every, every[0], rtol=1e-3):
        raise ValueError("time: a phase needs four evenly spaced times or more.")
    window = np.hanning(len(time))[:, None]
    ours, theirs = (np.fft.rfft((a - a.mean(axis=0)) * window, axis=0) for a in (values, reference))
    power = (np.abs(theirs[1:]) ** 2).sum(axis=1)
    if not power.max() > 0.0:
        raise ValueError("reference: it does not oscillate, so it has no phase.")
    strongest = 1 + int(np.argmax(power))
    cross = (ours[strongest] * theirs[strongest].conj()).sum()
    return float(np.degrees(np.angle(cross))), float(strongest / (len(time) * every[0]))


def surface_height(
    trajectory: Trajectory,
    scene: Scene,
    gauge: float | tuple[float, ...],
    width: float | None = None,
) -> Float[np.ndarray, " times"]:
    """What a wave gauge sees: the water above a stretch of floor, divided by the stretch [m],

        h(t) = sum_i V_i prod_d exp(-((x_id - g_d) / s)^2 / 2) / ((2 pi)^(1/2) s),    V = m / rho,

    d the horizontal directions (all but the last), with periodic images, and mirror images at the
    faces of the box that are not periodic. A wave of wave number k is seen exp(-(k s)^2 / 2) as
    high as it is.

    Args:
        trajectory: of the scene.
        scene: its box, and the mass of its particles.
        gauge: g, a number in two dimensions [m].
        width: s [m]; a spacing if none is given, which smooths a lattice's columns to 5e-9.

    Raises:
        ValueError: for a gauge that is outside of the box, or a width that is not positive.

    Examples:
        >>> import jaxsph
        >>> from jaxsph.metrics import surface_height
        >>> scene = jaxsph.scenes.hydrostatic_tank(20)
        >>> rest = jaxsph.Schedule(scene.time_step, steps_per_snapshot=1, intervals=1)
        >>> run = jaxsph.simulate(scene.model(), scene.state, rest)
        >>> surface_height(run, scene, 0.3).round(2)
        array([1., 1.])
    """
    space = scene.space
    box, width = space.box, space.spacing if width is None else float(width)
    places = np.atleast_1d(np.asarray(gauge, float))
    if len(places) != box.dim - 1:
        raise ValueError(f"gauge: {box.dim - 1} horizontal coordinates, got {places.tolist()}.")
    if not width > 0.0:
        raise ValueError(f"width: must be positive, got {width:g} m.")
    column = float(scene.mass) / trajectory.density
    if trajectory.active is not None:
        column = np.where(trajectory.active, column, 0.0)
    for axis, place in enumerate(places):
        low, length = box.lower[axis], box.lengths[axis]
        if not low <= place <= low + length:
            raise ValueError(
                f"gauge: {place:g} m is outside of the box, which is from {low:g} to "
                f"{low + length:g} m."
            )
        x = trajectory.position[:, :, axis]
        if box.periodic[axis]:
            images = (x - length, x, x + length)
        else:
            images = (2.0 * low - x, x, 2.0 * (low + length) - x)
        seen = sum(np.exp(-0.5 * ((image - place) / width) ** 2) for image in images)
        column = column * seen / (np.sqrt(2.0 * np.pi) * width)
    return column.sum(axis=1)


def probe_line(space: Space, axis: int, through: tuple[float, ...], count: int) -> np.ndarray:
    """(count, n) evenly spaced probes [m] along an axis of the box, through a given point."""
    lower, length = space.box.lower[axis], space.box.lengths[axis]
    line = np.tile(np.asarray(through, float), (count, 1))
    line[:, axis] = lower + (np.arange(count) + 0.5) * (length / count)
    return line


def vertical_slice(space: Space, x: float) -> np.ndarray:
    """Probes on a vertical line at x [m] (along the second axis), one per spacing."""
    box = space.box
    if not box.lower[0] <= x <= box.upper[0]:
        raise ValueError(
            f"slice: x = {x:g} m is outside the box, which is from {box.lower[0]:g} to "
            f"{box.upper[0]:g} m."
        )
    middle = tuple(a + 0.5 * b for a, b in zip(box.lower, box.lengths, strict=True))
    return probe_line(space, 1, (x, *middle[1:]), round(box.lengths[1] / space.spacing))


def centre_line(space: Space) -> np.ndarray:
    """Probes on the vertical centre line (along the second axis), one per spacing."""
    return vertical_slice(space, space.box.lower[0] + 0.5 * space.box.lengths[0])


def probe(
    trajectory: Trajectory,
    points: np.ndarray,
    space: Space,
    rule: type[KernelMap] = ShepardMap,
) -> tuple[Float[np.ndarray, "times probes"], Float[np.ndarray, "times probes"]]:
    """Velocity norm [m/s] and pressure [Pa] at points at all times.

    By Shepard interpolation, or by `MovingLeastSquaresMap`, which keeps linear fields next to walls
    too.
    """
    interpolated = rule.allocate(jnp.asarray(points, trajectory.position.dtype), space)

    speed, pressure = [], []
    for k in range(len(trajectory.time)):
        values = np.concatenate([trajectory.velocity[k], trajectory.pressure[k][:, None]], axis=1)
        active = None if trajectory.active is None else trajectory.active[k]
        fields, overflow = _interpolated(interpolated, trajectory.position[k], values, active)
        if bool(overflow):
            raise ValueError(f"probe: particles have clumped at snapshot {k}; cells are too full.")
        fields = np.asarray(fields)
        speed.append(np.linalg.norm(fields[:, :-1], axis=1))
        pressure.append(fields[:, -1])
    return np.stack(speed), np.stack(pressure)


@eqx.filter_jit  # compiled once for runs alike
def _interpolated(rule: KernelMap, position, values, active):
    return rule(position, values, active)


def local_quadratic(
    points: Float[np.ndarray, "probes dim"],
    position: Float[np.ndarray, "particles dim"],
    values: Float[np.ndarray, " particles"],
    radius: float,
) -> Float[np.ndarray, " probes"]:
    """Values at points by weighted least squares of a quadratic; exact for quadratic fields.

    The weight is (1 - r/R)^4 (1 + 4 r/R), R the radius; three spacings hold particles enough. Next
    to a wall the fit is one-sided and as exact. A linear fit over a kernel's support has an error
    of the size of the second derivative there, which is more than what it is to judge
    (`tests/test_metrics.py` has both on the exact lid-driven cavity).

    Args:
        points: where values are wanted [m].
        position: of the particles [m]; no periodic images are made.
        values: of the particles.
        radius: R [m].

    Raises:
        ValueError: if a point has too few particles within the radius.
    """
    dim = points.shape[1]
    upper = np.triu_indices(dim)
    found = np.empty(len(points))
    for k, point in enumerate(points):
        offset = (position - point) / radius
        distance = np.linalg.norm(offset, axis=1)
        near = distance < 1.0
        offset, distance = offset[near], distance[near]
        products = offset[:, upper[0]] * offset[:, upper[1]]
        columns = np.concatenate([np.ones((len(offset), 1)), offset, products], axis=1)
        if len(offset) < columns.shape[1]:
            raise ValueError(
                f"radius: {radius:g} m around the point {point} holds {len(offset)} particles; a "
                f"quadratic needs {columns.shape[1]}. Take a larger one."
            )
        weight = np.sqrt((1.0 - distance) ** 4 * (1.0 + 4.0 * distance))
        fit = np.linalg.lstsq(columns * weight[:, None], values[near] * weight, rcond=None)
        found[k] = fit[0][0]
    return found
