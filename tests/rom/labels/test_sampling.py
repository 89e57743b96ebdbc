"""The full functional at a few particles: what it sees, and a wave that it predicts."""

import dataclasses
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import ParticleState, run_scene
from jaxsph.metrics import surface_height
from jaxsph.scenes import piston_wave_maker, standing_wave
from jaxsph_rom.labels import SampledSystem, load, train
from jaxsph_rom.points import QDEIM

from .test_training import AMPLITUDES, UNSEEN, make


def short(amplitude):
    """40 x 20 particles, 21 snapshots."""
    scene = standing_wave(40, amplitude=amplitude, time_step=0.01, end_time=1.0)
    return dataclasses.replace(scene, steps_per_snapshot=5)


@pytest.fixture(scope="module")
def sampled():
    run = run_scene(short(0.05), measure=None)
    return train(short, [{"amplitude": 0.05}], 2, runs=[run], recovered=4, sampling=QDEIM(3))


def test_samples_see_all_that_moves_them(sampled):
    """Their rates are those of the full functional on all particles."""
    system, scene = sampled.system, short(0.05)
    members, count = len(system.labels), len(sampled.labels)
    assert isinstance(system, SampledSystem) and members < 0.8 * count
    places = np.asarray(system.labels)
    where = [int(np.argmin(np.abs(sampled.labels - at).sum(axis=1))) for at in places]
    coordinates = jnp.asarray(sampled.predict({"amplitude": 0.045}).coordinates[0, 14])
    time, values = jnp.asarray(0.7), jnp.asarray(sampled.predict({"amplitude": 0.045}).values[0])
    fields = sampled.fields(np.asarray([0.7]), np.asarray(coordinates)[None], np.asarray(values))
    state = ParticleState(*(jnp.asarray(a[0]) for a in (
        fields.position, fields.velocity, fields.density
    )))  # fmt: skip
    full = scene.model(state)
    wanted = jax.jit(lambda state: full.functional(time, state, full.prepare(state)))(state)
    there = ParticleState(*(a[jnp.asarray(where)] for a in (
        state.position, state.velocity, state.density
    )))  # fmt: skip
    found = jax.jit(lambda s: system.inputs.functional(time, s, system.neighbors))(there)
    samples = system.gather.shape[1]
    largest = float(jnp.abs(wanted.velocity).max())
    for name in ("position", "velocity"):
        one, other = (getattr(f, name) for f in (found, wanted))
        off = one[:samples] - other[jnp.asarray(where[:samples])]
        assert float(jnp.abs(off).max()) < 1e-10 * largest


def test_particles_that_samples_do_not_know_are_named(sampled):
    """In the run that it was trained on none comes near; one that is put near is seen."""
    prediction = sampled.predict({"amplitude": 0.05})
    assert prediction.strayed_from(0) is None
    labels, space = sampled.labels, sampled.space
    still = np.repeat(labels[None], 2, axis=0)
    assert not sampled.system.strayed(still, labels, space).any()
    followed = (np.asarray(sampled.system.labels)[:, None] == labels).all(axis=2).any(axis=0)
    stranger, sample = int(np.flatnonzero(~followed)[0]), np.asarray(sampled.system.labels[0])
    still[1, stranger] = sample + 0.5 * space.support * np.asarray([1.0, 0.0])
    np.testing.assert_array_equal(sampled.system.strayed(still, labels, space), [False, True])


@pytest.mark.slow  # its programs take seconds to compile
def test_rates_differentiate(sampled):
    """Along a direction, forward and backward, against central differences."""
    system, values = sampled.system, jnp.zeros(0)
    a, way, time = jnp.asarray([3.0, -2.0]), jnp.asarray([0.6, 0.8]), jnp.asarray(0.2)
    rates = jax.jit(lambda a: system.rates(time, a, values))
    step = 1e-4
    wanted = (rates(a + step * way) - rates(a - step * way)) / (2.0 * step)
    _, found = jax.jvp(rates, (a,), (way,))
    np.testing.assert_allclose(found, wanted, rtol=1e-6)
    _, back = jax.vjp(rates, a)
    np.testing.assert_allclose(back(way)[0] @ way, found @ way, rtol=1e-9)


@pytest.mark.slow  # half a minute
def test_a_wave_of_an_unseen_amplitude(tmp_path):
    """Two periods and a quarter, from twelve of 128 particles."""
    points = [{"amplitude": a} for a in AMPLITUDES]
    trained = train(make, points, 3, recovered=8, sampling=QDEIM(12))
    full, scene = run_scene(make(UNSEEN), measure=None), make(UNSEEN)
    prediction = trained.predict({"amplitude": UNSEEN})
    seen, wanted = (surface_height(run, scene, 0.0) for run in (prediction.fields(0), full))
    assert prediction.status[0] == 0
    assert np.sqrt(np.mean((seen - wanted) ** 2)) < 0.03 * UNSEEN
    trained.save(tmp_path / "wave.h5")
    again = load(tmp_path / "wave.h5").predict({"amplitude": UNSEEN})
    np.testing.assert_array_equal(again.coordinates, prediction.coordinates)


@pytest.mark.parametrize(
    ("scene", "resolution", "samples", "message"),
    [
        (piston_wave_maker, 60, 4, "walls that move have no samples yet; learn tensors instead"),
        (standing_wave, 16, 500, "samples: 500 asked for, but there are 1 to 128 points"),
    ],
)
def test_what_has_no_samples_is_refused_before_anything_runs(
    scene, resolution, samples, message
):
    with pytest.raises(ValueError, match=message):
        train(partial(scene, resolution), [{"mach": 0.1}], sampling=QDEIM(samples))
