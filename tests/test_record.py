"""Objects and values go into files and come back as they were."""

import dataclasses
import json

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import kernels
from jaxsph.arrangements import JitteredLattice, Lattice
from jaxsph.io import TrajectoryWriter, read_overview
from jaxsph.kernels import Kernel, WendlandC2, WendlandC4
from jaxsph.record import plain, record, restored
from jaxsph.scenes import lid_driven_cavity, taylor_green
from jaxsph.scenes.record import scene_from_record
from jaxsph.schemes import Consistent
from jaxsph.sweeps import read_status, sweep_file


@dataclasses.dataclass(frozen=True)
class Wide(Kernel):
    """Wendland's kernel with a support of one's own choice."""

    support = 2.0
    normalisation = WendlandC2.normalisation
    factor: float = 1.0

    def value(self, r, h, dim):
        return WendlandC2().value(r, self.factor * h, dim)

    def gradient_over_r(self, r, h, dim):
        return WendlandC2().gradient_over_r(r, self.factor * h, dim)


@dataclasses.dataclass(frozen=True)
class Shifted(Lattice):
    """A lattice moved by a way."""

    way: float = 0.1

    def positions(self, space):
        return space.box.wrap(Lattice().positions(space) + self.way * space.spacing)


def stored(parameters):
    """As a file keeps them."""
    return json.loads(json.dumps(plain(parameters)))


def test_an_own_kernel_and_arrangement_come_back_with_their_settings():
    scene = taylor_green(16, kernel=Wide(0.9), arrangement=Shifted(0.3), scheme=Consistent())
    kept = stored(scene.parameters)
    assert kept["kernel"] == {"rule": f"{Wide.__module__}:Wide", "factor": 0.9}
    again = scene_from_record(scene.name, kept)
    assert again.space.kernel == Wide(0.9)
    np.testing.assert_array_equal(again.state.position, scene.state.position)
    assert [e.name for e in again.effects] == [e.name for e in scene.effects]


def test_what_this_library_offers_has_its_short_name():
    assert record(WendlandC4()) == "WendlandC4"
    assert JitteredLattice(seed=2).record()["rule"] == "JitteredLattice"
    parameters = lid_driven_cavity(16).parameters
    assert (parameters["kernel"], parameters["scheme"]) == ("WendlandC2", "Consistent")
    assert restored("WendlandC4", Kernel, kernels) == WendlandC4()


def test_what_cannot_be_found_again_is_named():
    class Local(Wide):
        pass

    with pytest.raises(ValueError, match=r"kernel: .*<locals>.Local is not found here"):
        restored(record(Local()), Kernel, kernels)
    with pytest.raises(ValueError, match="kernel: os:system is no Kernel"):
        restored("os:system", Kernel, kernels)
    with pytest.raises(ValueError, match="kernel: no.such:Kernel is not found here"):
        restored({"rule": "no.such:Kernel"}, Kernel, kernels)
    with pytest.raises(ValueError, match="kernel: .*unexpected keyword argument 'width'"):
        restored({"rule": "WendlandC2", "width": 1.0}, Kernel, kernels)


def test_numbers_of_numpy_and_jax_are_parameters(tmp_path):
    assert plain({"a": jnp.asarray(0.5), "b": float("nan")}) == {"a": 0.5, "b": None}
    given = {"a": np.float32(0.5), "b": np.asarray(2), "c": np.arange(2), "d": (np.bool_(True),)}
    wanted = {"a": 0.5, "b": 2, "c": [0, 1], "d": [True]}
    scene = taylor_green(12, arrangement=Lattice(), end_time=0.04)
    scene = dataclasses.replace(scene, parameters=given)
    TrajectoryWriter.create(tmp_path / "t.h5", scene).close()
    assert read_overview(tmp_path / "t.h5").parameters == wanted
    sweep_file.create(tmp_path / "sweep.h5", [scene])
    assert read_status(tmp_path / "sweep.h5").parameters == [wanted]
    odd = dataclasses.replace(scene, parameters={"a": {"b": [1, object()]}})
    with pytest.raises(ValueError, match=r"parameters.a.b\[1\]: .*cannot"):
        TrajectoryWriter.create(tmp_path / "odd.h5", odd)
    assert not (tmp_path / "odd.h5").exists()
