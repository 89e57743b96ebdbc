"""One simulation over several devices is the one of a single device, to round-off.

Devices here are parts of one CPU, in a process of their own that has eight. A program for several
adds up what is summed over all particles in another order; over 200 steps such round-off grows as
it does between two numberings of the same particles.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxsph
from jaxsph.arrangements import Lattice
from jaxsph.integrate import integrate
from jaxsph.scenes import lid_driven_cavity, taylor_green

ROOT = Path(__file__).parents[1]
WORKER = Path(__file__).with_name("devices_worker.py")
ROUND_OFF = 1e-13


def found(check, scene, *arguments, soon=True):
    """What a check of `devices_worker.py` finds, run with eight devices."""
    flags = os.environ.get("XLA_FLAGS", "") + " --xla_force_host_platform_device_count=8"
    soon = {"JAX_DISABLE_MOST_OPTIMIZATIONS": "1"} if soon else {}  # a few steps: compiled sooner
    # programs kept by JAX's compilation cache can hang on a divided CPU (docs/devices.md)
    kept = {k: v for k, v in os.environ.items() if k != "JAX_COMPILATION_CACHE_DIR"}
    process = subprocess.run(
        [sys.executable, WORKER, check, scene, *map(str, arguments)], capture_output=True,
        text=True, cwd=ROOT, check=False,
        env={**kept, "JAX_PLATFORMS": "cpu", "PYTHONPATH": str(ROOT), "XLA_FLAGS": flags}
        | soon,
    )  # fmt: skip
    assert process.returncode == 0, process.stderr[-2000:]
    return json.loads(process.stdout.splitlines()[-1])


def lowered(model, state):
    def run(model, state):
        return integrate(model, state, jnp.asarray(0), jnp.asarray(1e-3), 2, 1)[0]

    return eqx.filter_jit(run).lower(model, state).as_text()


@pytest.mark.parametrize("scene, steps", [("vortex", 12), ("openings", 20)])
def test_eight_devices_are_one(scene, steps):
    """31 x 31 particles divide into no eight equal shares; their list is rebuilt on the way.
    Who is put in through an opening is the same particle."""
    difference = found("run", scene, steps)
    assert difference.pop("way_over_half_skin") > 1.0  # so a list was built in mid-run
    assert all(0.0 <= d < ROUND_OFF for d in difference.values()), difference


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene", ["vortex", "cavity", "dam break", "vortex in 3D", "small vortex", "small cavity"]
)
def test_eight_devices_are_one_over_200_steps(scene):
    assert found("exchange", scene)["kind"] == ("Gathered" if "small" in scene else "Halo")
    difference = found("run", scene, 200, soon=False)
    assert difference.pop("way_over_half_skin") > 1.0
    assert "3D" in scene or difference["density"] < ROUND_OFF
    other_order = found("order", scene, 200, soon=False)  # on one device
    for name, apart in difference.items():
        assert apart < max(ROUND_OFF, 4.0 * other_order[name]), (name, apart, other_order)


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["vortex", "cavity", "dam break"])
def test_gradients_are_those_of_one_device(scene):
    assert max(found("gradient", scene).values()) < ROUND_OFF


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["piston", "cavity"])
def test_forces_and_their_means_are_those_of_one_device(scene):
    """Bodies that are moved among them, and automatic steps."""
    assert max(found("forces", scene).values()) < ROUND_OFF


@pytest.mark.slow
def test_forward_mode_members_and_eager_calls():
    assert max(found("ways", "cavity").values()) < ROUND_OFF


@pytest.mark.slow
@pytest.mark.parametrize("limit", ["list", "halo"])
def test_what_overflows_is_enlarged_and_a_fault_names_the_same_particle(limit):
    assert found("faults", "cavity", limit) == {"enlarged": True, "same": True}


@pytest.mark.slow
def test_a_run_goes_on_with_another_number_of_devices(tmp_path):
    difference = found("resume", "cavity", tmp_path)
    assert max(difference.values()) < ROUND_OFF


@pytest.mark.run_once
def test_without_devices_no_program_knows_of_them():
    scene = taylor_green(16, arrangement=Lattice())
    model = scene.model()
    assert "shard" not in lowered(model, scene.state)
    assert "shard" in lowered(model.over(jaxsph.Devices(jax.devices()[:1])), scene.state)


def test_a_window_shows_the_rows_that_it_says():
    """Halos within the next device's rows, of just these, and deeper."""
    assert found("window", "vortex") == {"wrong": 0}


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["even vortex", "even cavity"])
def test_no_field_of_all_particles_is_sent_for_a_right_hand_side(scene):
    """25 columns are read, of halos alone; the gradient sends more of these and nothing else. At
    walls there are arrays with a row for each particle near them."""
    sent = found("halos", scene)
    assert sent["columns"] == 25.0
    assert sent["columns_of_gradient"] > 25.0
    assert sent["whole"] == 0


@pytest.mark.slow
def test_a_run_gathers_states_only_where_lists_are_built_and_at_its_ends():
    """5 numbers a particle where it begins, where it ends, where its list is built anew, and where
    it is handed over; whatever is sent for right-hand sides comes on top."""
    sent = found("run_halos", "vortex")
    assert sent["columns"] == 25.0
    assert sent["others"] < 1.05 * 4 * 5


@pytest.mark.slow
def test_the_list_is_divided_and_not_moved():
    """Each device has its rows; for a right-hand side it is sent fields of particles alone."""
    sent = found("traffic", "small cavity")
    assert sent.pop("share_of_list") == pytest.approx(1.0 / 8.0)
    numbers = sent.pop("f64") / 8.0  # a particle
    assert 20.0 < numbers < 200.0
    assert sum(sent.values()) < 8.0  # bytes, of which a row of the list has some four hundred


def test_what_is_no_set_of_devices_is_refused():
    device = jax.devices()[0]
    with pytest.raises(ValueError, match="devices: got none; give at least one"):
        jaxsph.Devices(())
    with pytest.raises(ValueError, match="devices: one stands there twice"):
        jaxsph.Devices((device, device))
    for no_devices in (4, "cpu", [0]):
        with pytest.raises(ValueError, match="devices: got .*; give .*, as jax.devices"):
            jaxsph.Devices(no_devices)
    assert tuple(jaxsph.Devices([device])) == (device,)
    with pytest.raises(ValueError, match="asked for 999, JAX has .*device_count=999"):
        jaxsph.Devices.first(999)


@pytest.mark.parametrize("kept", ["programs", None])
def test_parts_of_a_cpu_warn_of_programs_that_are_kept(monkeypatch, recwarn, kept):
    monkeypatch.setattr(jaxsph.Devices, "count", 8)
    folder = jax.config.jax_compilation_cache_dir
    jax.config.update("jax_compilation_cache_dir", kept)
    try:
        jaxsph.Devices(jax.devices()[:1]).warn_of_kept_programs()
    finally:
        jax.config.update("jax_compilation_cache_dir", folder)
    told = [str(warning.message) for warning in recwarn]
    assert bool(told) == bool(kept) and all("JAX_COMPILATION_CACHE_DIR" in each for each in told)


def test_a_reduced_model_is_run_by_one_device():
    class Decay(jaxsph.integrate.Model):
        def rates(self, time, state, auxiliary):
            return -state

    schedule = jaxsph.Schedule(0.1, 1, 1)
    with pytest.raises(ValueError, match="devices: a Decay is run by one device; leave"):
        jaxsph.simulate(Decay(), jnp.ones(2), schedule, devices=jax.devices()[:1])


@pytest.mark.run_once
def test_a_single_device_lists_pairs_at_walls_as_ever():
    """One device that shares with nobody has the list that it has alone."""
    scene = lid_driven_cavity(12)
    model = scene.model()
    alone = model.prepare(scene.state).wall
    shared = model.over(jaxsph.Devices(jax.devices()[:1])).prepare(scene.state).wall
    for name in ("index", "near", "ghosts"):
        np.testing.assert_array_equal(getattr(shared, name), getattr(alone, name))
