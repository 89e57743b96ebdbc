"""Taylor-Green vortices in closed form: on the unit square for all time, on the unit cube at t = 0.

The velocity amplitude is U = 1 m/s, the period L = 1 m and the wave number k = 2 pi / L.
"""

from dataclasses import dataclass
from math import pi
from typing import final

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, ScalarLike

WAVENUMBER = 2.0 * pi


@jax.jit
def velocity(
    position: Float[Array, "*points 2"], time: ScalarLike, viscosity: ScalarLike
) -> Float[Array, "*points 2"]:
    """Velocity of the decaying two-dimensional vortex [m/s]:

        u = (sin kx cos ky, -cos kx sin ky) exp(-2 nu k^2 t)

    Args:
        position: [m].
        time: [s].
        viscosity: kinematic [m^2/s].
    """
    x, y = _phases(position, dim=2)
    u = jnp.stack([jnp.sin(x) * jnp.cos(y), -jnp.cos(x) * jnp.sin(y)], axis=-1)
    return u * _decay(time, viscosity)


@jax.jit
def pressure(
    position: Float[Array, "*points 2"],
    time: ScalarLike,
    viscosity: ScalarLike,
    density: ScalarLike,
) -> Float[Array, "*points"]:
    """Pressure of the decaying two-dimensional vortex, with zero mean [Pa]:

        p = rho/4 (cos 2kx + cos 2ky) exp(-4 nu k^2 t)

    Rodriguez et al. (arXiv:2507.07830) print it with the opposite sign, which with this velocity
    does not satisfy the momentum equation.

    Args:
        position, time, viscosity: as for `velocity`.
        density: [kg/m^3].
    """
    x, y = _phases(position, dim=2)
    p = jnp.cos(2.0 * x) + jnp.cos(2.0 * y)
    return p * (0.25 * density * _decay(time, viscosity) ** 2)


def kinetic_energy(
    time: ScalarLike, viscosity: ScalarLike, density: ScalarLike
) -> Float[Array, ""]:
    """Kinetic energy of the two-dimensional vortex in the unit square [J per m of depth]:

        E = 1/2 rho int |u|^2 = rho/4 exp(-4 nu k^2 t)

    Args:
        time, viscosity, density: as for `pressure`.
    """
    return 0.25 * density * _decay(time, viscosity) ** 2


@final
@dataclass(frozen=True)
class DecayingVortex:
    """`velocity` and `pressure` of the two-dimensional vortex at positions and a time.

    Args:
        viscosity: kinematic [m^2/s].
        density: [kg/m^3].
    """

    viscosity: float
    density: float

    def __call__(self, position, time):
        return (
            velocity(position, time, self.viscosity),
            pressure(position, time, self.viscosity, self.density),
        )


def initial_velocity_3d(position: Float[Array, "*points 3"]) -> Float[Array, "*points 3"]:
    """Initial velocity of the three-dimensional vortex [m/s]:

        u = (sin kx cos ky cos kz, -cos kx sin ky cos kz, 0)

    Args:
        position: [m].
    """
    x, y, z = _phases(position, dim=3)
    u = jnp.sin(x) * jnp.cos(y) * jnp.cos(z)
    v = -jnp.cos(x) * jnp.sin(y) * jnp.cos(z)
    return jnp.stack([u, v, jnp.zeros_like(u)], axis=-1)


def initial_pressure_3d(
    position: Float[Array, "*points 3"], density: ScalarLike
) -> Float[Array, "*points"]:
    """Initial pressure of the three-dimensional vortex, with zero mean [Pa]:

        p = rho/16 (cos 2kx + cos 2ky) (cos 2kz + 2)

    Args:
        position: [m].
        density: [kg/m^3].
    """
    x, y, z = _phases(position, dim=3)
    p = (jnp.cos(2.0 * x) + jnp.cos(2.0 * y)) * (jnp.cos(2.0 * z) + 2.0)
    return p * (0.0625 * density)


def _phases(position, dim):
    """k x, one array an axis."""
    if position.shape[-1:] != (dim,):
        raise ValueError(f"position: expected shape (..., {dim}), got {position.shape}.")
    return tuple(WAVENUMBER * position[..., axis] for axis in range(dim))


def _decay(time, viscosity):
    return jnp.exp(-2.0 * WAVENUMBER**2 * viscosity * time)
