"""Inflows that change in time: an exact flow to and fro, one that stops, a run taken up again."""

from types import SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from jaxsph import run_scene
from jaxsph.arrangements import JitteredLattice
from jaxsph.effects import Fringe, ParabolicProfile, Varying
from jaxsph.scenes import FringeEnds, OpenEnds, Scale
from jaxsph.scenes.open_channel import open_channel

NU, PERIOD = 0.1, 4.0  # m^2/s, s; height, peak speed and density are 1


class ToAndFro(eqx.Module):
    """Flow between plates under a pressure gradient that swings (Womersley 1955, plane):

    u = Re[A (1 - cosh(k (y - 1/2)) / cosh(k / 2)) exp(i w t)], k = (i w / nu)^1/2,

    A such that the middle's speed is 1 at most.
    """

    def __call__(self, position, time):
        w = 2.0 * np.pi / PERIOD
        k = np.sqrt(1j * w / NU)
        peak = 1.0 / abs(1.0 - 1.0 / np.cosh(0.5 * k))
        y = position[:, 1] - 0.5
        z = lax.complex(float(k.real) * y, float(k.imag) * y)
        shape = 1.0 - jnp.cosh(z) * jnp.asarray(1.0 / np.cosh(0.5 * k), z.dtype)
        swing = jnp.real(shape) * jnp.cos(w * time) - jnp.imag(shape) * jnp.sin(w * time)
        return jnp.zeros_like(position).at[:, 0].set(peak * swing)


ENDS = [
    pytest.param(FringeEnds(1.0), id="fringe", marks=pytest.mark.slow),
    pytest.param(OpenEnds(), id="openings"),
]


@pytest.fixture(scope="module", params=ENDS)
def scene(request):
    return open_channel(
        "to-and-fro",
        length=1.5,
        ends=request.param,
        height=1.0,
        mean_speed=2.0 / 3.0,
        inflow=ToAndFro(),
        scale=Scale(12, 1.5, 6.25e-3, 80),
        end_time=3.0,
        viscosity=NU,
        mach=0.05,
        layers=None,
        arrangement=JitteredLattice(amplitude=0.25),
        kernel=None,
        scheme=None,
        dtype=None,
        parameters={},
    )


@pytest.fixture(scope="module")
def flow(scene):
    return run_scene(scene)


def test_flow_to_and_fro_is_the_exact_one(flow):
    """Out at the inlet and in at the outlet for half of the time."""
    errors, means = [], []
    for time, position, velocity in zip(flow.time, flow.position, flow.velocity, strict=True):
        inside = (position[:, 0] > 0.0) & (position[:, 0] < 1.5)
        exact = ToAndFro()(jnp.asarray(position[inside]), jnp.asarray(time))
        errors.append(np.sqrt(((velocity[inside] - exact) ** 2).sum(axis=1).mean()))
        means.append(float(exact[:, 0].mean()))
    assert min(means) < -0.5 and max(means) > 0.5
    # of the peak: compressibility w^2 L^2 / 8 c0^2 = 0.2 percent, twelve particles across the rest
    assert max(errors) < 0.02


def test_a_run_goes_on_amid_the_change(scene, flow, tmp_path):
    class Killed(Exception):
        pass

    def kill(steps, done=[0]):  # noqa: B006
        done[0] += steps
        if done[0] >= scene.steps // 2:
            raise Killed

    with pytest.raises(Killed):
        run_scene(scene, tmp_path / "run.h5", progress=kill)
    again = run_scene(scene, tmp_path / "run.h5")
    np.testing.assert_array_equal(again.position, flow.position)
    np.testing.assert_array_equal(again.velocity, flow.velocity)


def test_factor_changes_the_strength_alone(scene):
    parabola = ParabolicProfile(jnp.ones(()), 1.0)
    falling = Varying(parabola, lambda time: 1.0 - 0.5 * time)
    fringe = Fringe(falling, jnp.asarray(20.0), 0.0, 1.0)
    position = scene.state.position
    held = (position[:, 0] > 0.5) & (position[:, 0] < 1.0)
    for time in (0.0, 1.0):
        inflow = falling(position, jnp.asarray(time))
        np.testing.assert_allclose(inflow, (1.0 - 0.5 * time) * parabola(position, 0.0))
        context = SimpleNamespace(time=jnp.asarray(time))
        pushed = {"velocity": jnp.ones_like(position)}
        rates = fringe.governed(context, {"position": position, "velocity": inflow}, pushed)
        # in step with the inflow: what is left is the inflow's own rate of change
        expected = -0.5 * parabola(position, 0.0)
        np.testing.assert_allclose(rates["velocity"][held], expected[held], atol=1e-12)
    slope = jax.grad(lambda f: jnp.sum(Varying(parabola, lambda t: f * t)(position, 2.0)))(1.0)
    assert float(slope) == pytest.approx(2.0 * float(parabola(position, 0.0).sum()))
