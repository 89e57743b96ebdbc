"""What passes a section of an open channel is what was put through it."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks import open_flux
from jaxsph import Box

SPACING, LENGTH = 0.05, 3.0
BOX = Box((0.0, 0.0), (LENGTH, 1.0), (True, False))
SCENE = SimpleNamespace(mass=SPACING**2, space=SimpleNamespace(box=BOX))


def carried(speed, time, density):
    """Rows of a jittered lattice, carried along a periodic box, each as fast as its height says."""
    x, y = (a.ravel() for a in np.meshgrid(*(np.arange(0.5 * SPACING, end, SPACING)
                                             for end in (LENGTH, 1.0))))  # fmt: skip
    x = x + SPACING * np.random.default_rng(0).uniform(-0.25, 0.25, len(x))
    way = np.array([speed(y, t) for t in time])
    position = np.stack([(x + way) % LENGTH, np.broadcast_to(y, way.shape)], axis=2)
    return SimpleNamespace(time=time, position=position, density=np.full(way.shape, density))


def test_a_parabola_passes_every_section():
    time = np.arange(0.0, 8.0, 0.025)
    flow = carried(lambda y, t: 4.0 * y * (1.0 - y) * t, time, 1.01)
    mass, volume = open_flux.passing(SCENE, flow, np.array([0.0, 0.4, 1.7]), 3.0)
    expected = SPACING * np.sum(4.0 * (y := np.arange(0.5, 20.0) / 20.0) * (1.0 - y))
    # of some 1,300 particles, each row's almost evenly apart, none counted at the window's ends
    np.testing.assert_allclose(mass, expected, rtol=1e-3)
    np.testing.assert_allclose(volume, mass / 1.01, rtol=1e-12)


def test_what_swings_to_and_fro_passes_nothing():
    time = np.arange(0.0, 8.0, 0.025)
    flow = carried(lambda y, t: 0.7 * np.sin(2.0 * np.pi * t) + 0.0 * y, time, 1.0)
    mass, _ = open_flux.passing(SCENE, flow, np.array([0.4, 1.7]), 0.0)
    np.testing.assert_allclose(mass, 0.0, atol=1e-3)  # 2.8 on average either way


def test_means_begin_before_the_end(tmp_path, capsys):
    file = tmp_path / "flux.json"
    assert open_flux.main(["--t-end", "2", "--settled", "3", "--json", str(file)]) == 2
    assert "--settled: must be before the end, got 3 s" in capsys.readouterr().err
    assert not file.exists()


@pytest.mark.slow
def test_mass_is_what_the_inflow_brings(tmp_path):
    """The benchmark at a small size: 16 across, Mach 0.025, whose compression is 1e-3."""
    file = tmp_path / "flux.json"
    line = ["--resolutions", "16", "--machs", "0.025", "--t-end", "5", "--settled", "2"]
    assert open_flux.main([*line, "--json", str(file)]) == 0
    (row,) = json.loads(file.read_text())["rows"]
    assert row["fault"] is None
    assert row["mass_off"] < 2e-3 and row["mass_lost_on_the_way"] < 5e-4
