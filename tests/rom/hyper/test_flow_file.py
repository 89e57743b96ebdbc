"""A reduced flow in a file: there and back, and what is refused."""

import equinox as eqx
import h5py
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import Box, Fluid, Space
from jaxsph.arrangements import Lattice
from jaxsph.interpolation import MovingLeastSquaresMap
from jaxsph.io import TrajectoryFileError
from jaxsph.kernels import WendlandC4
from jaxsph_rom import Basis, ReferenceSpace
from jaxsph_rom.hyper import (
    FlowFileError,
    QuadraticSystem,
    ReducedFlow,
    TrainedFlow,
    load_flow,
    save_flow,
)


@pytest.fixture
def trained():
    rng = np.random.default_rng(0)
    space = Space(Box((0.0, -1.0), (2.0, 0.5), (True, False)), WendlandC4(), 0.2, 0.1)
    points = Lattice().positions(space)
    basis = Basis(
        0.1 * rng.normal(size=(len(points), 3, 4)), np.array([[1.0, 0.0, 0.0]]),
        np.array([9.0, 1.0, 1.0]), np.arange(7.0, 0.0, -1.0),
    )  # fmt: skip
    system = QuadraticSystem(
        *(jnp.asarray(0.1 * rng.normal(size=shape)) for shape in ((2, 4), (2, 4, 4), (4, 4, 4)))
    )
    reference = ReferenceSpace(points, space, MovingLeastSquaresMap)
    flow = ReducedFlow(reference, basis, system, Fluid(*map(jnp.asarray, (1.0, 20.0, 2.0))))
    return TrainedFlow(
        flow, np.array([0.01, 0.02]), 0.1 * rng.normal(size=(2, 4)), speed_times_length=3.0,
        time_step=0.01, steps_per_snapshot=5, snapshots=4, scene="a-flow",
        parameters={"resolution": 15}, training={"closure": "none"},
    )  # fmt: skip


def test_a_flow_comes_back_as_it_was(trained, tmp_path):
    path = tmp_path / "folder" / "flow.h5"
    save_flow(path, trained)
    again = load_flow(path)
    found, flow = again.flow, trained.flow
    assert [p.name for p in path.parent.iterdir()] == ["flow.h5"]
    assert found.reference.space == flow.reference.space
    assert type(found.reference.map) is MovingLeastSquaresMap
    start = jnp.asarray([0.1, -0.2, 0.3, 0.0])
    arguments = (start, 0.01, 0.01, 5, 4)
    np.testing.assert_array_equal(found.predict(*arguments), flow.predict(*arguments))
    mine, theirs = (
        f.fields(start[None], np.zeros(1), np.asarray(f.reference.points)[:3])
        for f in (found, flow)
    )
    np.testing.assert_array_equal(mine.density, theirs.density)
    np.testing.assert_array_equal(found.basis.singular_values, flow.basis.singular_values)
    for name in ("reference_density", "sound_speed", "reference_speed"):
        assert getattr(found.fluid, name) == getattr(flow.fluid, name)
        assert getattr(found.fluid, name).dtype == flow.reference.points.dtype


def test_a_centre_that_varies_is_kept(trained, tmp_path):
    path = tmp_path / "flow.h5"
    points = len(trained.flow.reference.points)
    centre = np.random.default_rng(1).normal(size=(points, 3))
    save_flow(path, eqx.tree_at(lambda t: t.flow.basis.centre, trained, centre))
    np.testing.assert_array_equal(load_flow(path).flow.basis.centre, centre)
    save_flow(path, eqx.tree_at(lambda t: t.flow.basis.centre, trained, centre[:2]))
    with pytest.raises(FlowFileError, match="damaged"):
        load_flow(path)


def test_how_it_is_run_comes_back_too(trained, tmp_path):
    save_flow(tmp_path / "flow.h5", trained)
    found = load_flow(tmp_path / "flow.h5")
    for name in (
        "speed_times_length", "time_step", "steps_per_snapshot", "snapshots", "scene", "parameters",
        "training",
    ):  # fmt: skip
        assert getattr(found, name) == getattr(trained, name)
    np.testing.assert_array_equal(found.viscosities, trained.viscosities)
    np.testing.assert_array_equal(found.starts, trained.starts)


def test_foreign_damaged_and_newer_files_are_refused(trained, tmp_path):
    good, path = tmp_path / "good.h5", tmp_path / "flow.h5"
    save_flow(good, trained)

    def refused(match):
        with pytest.raises(FlowFileError, match=match) as caught:
            load_flow(path)
        assert "\n" not in str(caught.value)

    refused("cannot be read")
    path.write_text("text")
    refused("not an HDF5 file")
    content = good.read_bytes()
    for share in (0.1, 0.5, 0.99):
        path.write_bytes(content[: int(share * len(content))])
        refused("truncated or damaged")
    with h5py.File(path, "w") as file:
        file.attrs["format"] = "other"
    refused("holds no reduced flow")

    def changed(change, match):
        path.write_bytes(content)
        with h5py.File(path, "r+") as file:
            change(file)
        refused(match)

    changed(lambda f: f.attrs.modify("schema_version", 99), "schema version 99")
    changed(lambda f: f.attrs.modify("kernel", "Unheard"), "damaged")
    changed(lambda f: f.__delitem__("quadratic"), "damaged")

    def shorten(file):
        values = file["constant"][:, :3]
        del file["constant"]
        file["constant"] = values

    changed(shorten, "damaged")


def test_a_folder_is_no_target(trained, tmp_path):
    with pytest.raises(TrajectoryFileError, match="is a folder"):
        save_flow(tmp_path, trained)
