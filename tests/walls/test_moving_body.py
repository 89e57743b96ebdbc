"""Bodies that are moved: frames of reference, ghosts, gradients, and what is refused."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import Box, BoxRegion, Fluid, MovingBody, ParticleState, Space, Walls
from jaxsph.arrangements import JitteredLattice
from jaxsph.effects import (
    BodyForce,
    Continuity,
    DensityDiffusion,
    FreeSlip,
    LaminarViscosity,
    NoSlip,
    ParticleShifting,
    PressureForce,
    WallPressure,
    WallRepulsion,
)
from jaxsph.integrate import AutomaticSteps, FaultCode, FixedSteps, integrate
from jaxsph.kernels import WendlandC2
from jaxsph.scenes import Scene
from jaxsph.walls.walls import fill

DX = 0.1
FLUID = Fluid(1000.0, 10.0, 1.0)
ROOM = BoxRegion((-1.0, -0.8), (2.2, 1.8))
VESSEL = BoxRegion((0.0, 0.0), (1.0, 1.0))
SPACE = Space(Box(ROOM.lower, ROOM.upper, (False, False)), WendlandC2(), 2.0 * DX, DX)
SLIPS = {"no slip": NoSlip(), "free slip": FreeSlip()}


class Steady(eqx.Module):
    """d = U t"""

    velocity: jax.Array

    def __call__(self, time):
        return self.velocity * time


class Shaken(eqx.Module):
    """d = A (1 - cos w t)"""

    amplitude: jax.Array
    frequency: float = 5.0

    def __call__(self, time):
        return self.amplitude * (1.0 - jnp.cos(self.frequency * time))


class Inertia(BodyForce):
    """b = -d''(t), in the frame of a vessel that is displaced by d"""

    displacement: Shaken

    def acceleration(self, time, position):
        second = jax.jacfwd(jax.jacfwd(self.displacement))(time)
        return jnp.broadcast_to(-second[None, :], position.shape)


def scene(walls, slip, force=None, repelling=VESSEL, time_step=5e-3, velocity=(0.0, 0.0)):
    """A jittered, stirred, unevenly compressed fluid that fills the vessel."""
    rng = np.random.default_rng(3)
    x = fill(VESSEL, JitteredLattice(0.0).positions(SPACE), JitteredLattice(0.2, 1).positions(SPACE))
    density = 1000.0 * (1.0 + 0.003 * rng.normal(size=len(x)))
    stirred = 0.3 * rng.normal(size=x.shape) + np.asarray(velocity)
    effects = (
        Continuity(),
        PressureForce(),
        LaminarViscosity(jnp.asarray(0.01)),
        DensityDiffusion(jnp.asarray(0.1)),
        ParticleShifting(),
        *(() if force is None else (force,)),
        WallPressure(force),
        slip,
        WallRepulsion(repelling),
    )
    state = ParticleState(x, jnp.asarray(stirred), jnp.asarray(density))
    return Scene("vessel", effects, FLUID, SPACE, state, time_step, 0.4, 1, {}, walls)


def at_rest():
    return Walls.around(VESSEL, SPACE)


def moved(displacement):
    """The same vessel, its four walls one body."""
    return Walls.around(ROOM, SPACE, bodies=(MovingBody(~VESSEL, displacement),))


def run(scene, steps, stepping=FixedSteps(), interval=None):  # noqa: B008
    """The last state and the model's fault."""
    model, dt, interval = scene.model(), jnp.asarray(scene.time_step), interval or steps
    state, fault, _, _ = jax.jit(
        lambda s: integrate(model, s, 0, dt, interval, steps // interval, stepping)
    )(scene.state)
    assert int(fault.code) == FaultCode.NONE
    return state


# ------------------------------------------------------------------ frames of reference


@pytest.mark.parametrize("slip", SLIPS.values(), ids=SLIPS.keys())
def test_a_vessel_at_constant_velocity_is_one_at_rest(slip):
    """Galilei. `ShiftingTransport` is left out: the paper's form of it depends on the frame."""
    boost, steps = jnp.asarray([1.5, -0.8]), 60  # to 5 and 2 dx away; lists are built anew often
    still = run(scene(at_rest(), slip), steps)
    gone = run(scene(moved(Steady(boost)), slip, repelling=ROOM, velocity=boost), steps)
    way = boost[None, :] * steps * 5e-3
    print(jnp.abs(gone.position - way - still.position).max(),
        jnp.abs(gone.velocity - boost[None, :] - still.velocity).max(), jnp.abs(gone.density- still.density).max(), jnp.abs(still.velocity).max())
    np.testing.assert_allclose(gone.position - way, still.position, atol=1e-10)
    np.testing.assert_allclose(gone.velocity - boost[None, :], still.velocity, atol=1e-9)
    np.testing.assert_allclose(gone.density, still.density, rtol=1e-10)


@pytest.mark.parametrize("slip", SLIPS.values(), ids=SLIPS.keys())
def test_a_shaken_vessel_is_one_at_rest_under_inertia(slip):
    """d'Alembert: -d''(t) in the vessel's frame. A stage of RK4 knows the vessel's place exactly
    and the particles' to its own order, so that the two differ by O(dt^4)."""
    shaken, end = Shaken(jnp.asarray([0.08, -0.04])), 0.2
    differences = []
    for steps in (40, 80):
        dt = end / steps
        still = run(scene(at_rest(), slip, Inertia(shaken), time_step=dt), steps)
        gone = run(scene(moved(shaken), slip, repelling=ROOM, time_step=dt), steps)
        way, velocity, _ = MovingBody(VESSEL, shaken).motion(jnp.asarray(end))
        gap = gone.position - way[None, :] - still.position
        print(jnp.abs(gap).max(), jnp.abs(way), jnp.abs(gone.velocity - velocity[None, :] - still.velocity).max())
        differences.append(float(jnp.abs(gap).max()))
    print(differences)
