"""The script for a GPU, at a tiny size on this machine."""

import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks import device_check
from benchmarks.device_check import bytes_of, difference, main
from jaxsph.arrangements import Lattice
from jaxsph.scenes import taylor_green

TINY = ["--sides", "16", "--sides-3d", "--dtypes", "float32", "--vortex", "16", "--members", "50"]


@pytest.mark.slow
def test_it_measures_all_and_fails_where_a_result_is_not_the_cpus(tmp_path, monkeypatch):
    monkeypatch.setattr(device_check, "differences", lambda: {"cavity": 1e-15, "vortex": 2e-9})
    path = tmp_path / "out.json"
    assert main([*TINY, "--end-time", "0.02", "--json", str(path)]) == 1
    read = json.loads(path.read_text())
    assert read["environment"]["device"]["platform"] == "cpu" and read["left_out"] == 0
    programs = [row["program"] for row in read["rows"]]
    assert programs == ["list", "right-hand side", "gradient", "step", "tensors", "vortex"]
    assert all(row["seconds"] > 0.0 for row in read["rows"])
    tensors, vortex = read["rows"][-2:]
    assert tensors["failed"] == 0 and tensors["first_from_alone"] < 1e-5  # single precision
    # a tenth of what two steps lose: the viscous sum is off by some percent at h = 2 dx
    assert vortex["energy"] == pytest.approx(vortex["exact_energy"], rel=0.003)
    assert vortex["exact_energy"] < 0.98


@pytest.mark.slow
def test_small_states_are_the_cpus_and_a_late_case_is_left_out(tmp_path):
    path = tmp_path / "out.json"
    assert main([*TINY, "--budget", "1e-9", "--json", str(path)]) == 0
    read = json.loads(path.read_text())
    assert len(read["differences"]) == 4 and max(read["differences"].values()) < 1e-12
    assert read["rows"] == [] and read["left_out"] == 3


def test_differences_are_of_the_largest_and_nothing_wild_passes():
    exact = [np.asarray([1.0, -4.0]), np.zeros(2)]
    assert difference([np.asarray([1.0, -4.4]), np.zeros(2)], exact) == pytest.approx(0.1)
    assert difference([np.asarray([np.nan, -4.0]), np.zeros(2)], exact) == np.inf


def test_the_floor_counts_each_array_of_the_pair_sums_once():
    scene = taylor_green(16, arrangement=Lattice())
    model, state = scene.model(), scene.state
    lists = jax.eval_shape(model.search.build, state.position)
    total = bytes_of(lambda s, n: model.rates(jnp.zeros(()), s, n), state, lists)
    index = lists.index.size * 4
    passes = 3  # over the list: geometry, rates, and one for the mean of the shift
    assert passes * index < total < passes * (index + 30 * 256 * 8)
