"""Trajectories: shown, drawn, written, and handed on as labelled arrays."""

import dataclasses
import sys

import jax
import numpy as np
import pytest
from PIL import Image

from jaxsph import Timing, Trajectory
from jaxsph.io import TrajectoryFileError, read_box, read_checkpoint, read_overview, read_trajectory
from jaxsph.plotting import FIELDS, animate
from tests.runs import random_run


def run(path, **options):
    return read_trajectory(random_run(path, finish=True, **options))


def same(one, other):
    for name in ("time", "position", "velocity", "density", "pressure", "coordinates"):
        a, b = getattr(one, name), getattr(other, name)
        assert (a is None) == (b is None)
        if a is not None:
            np.testing.assert_array_equal(a, b)
            assert a.dtype == b.dtype
    return True


def test_shown_in_words(tmp_path):
    found = run(tmp_path / "t.h5")
    speed = np.linalg.norm(found.velocity, axis=-1)
    line, table = repr(found), found._repr_html_()
    assert "\n" not in line and len(line) < 400
    for told in (
        "taylor-green", "5, at 0 to 0.08 s", "256 in 2D",
        f"{speed.min():.4g} to {speed.max():.4g} m/s",
        f"{found.density.min():.4g} to {found.density.max():.4g} kg/m^3",
    ):  # fmt: skip
        assert told in line and told in table
    assert table.startswith("<table>") and table.count("<tr>") == table.count("</tr>") == 6
    found.velocity[2, 3] = np.nan
    assert "1 not finite" in repr(found)


def test_what_the_run_took(tmp_path):
    took = Timing(4, 0.02, 3.0, 1.0, enlarged_at=(2,))
    found = dataclasses.replace(run(tmp_path / "t.h5"), metadata=took.metadata())
    assert found.timing == took and found.timing.seconds(8) == 6.0
    save_again = read_trajectory(found.save(tmp_path / "again.h5"))
    assert save_again.timing == took
    with pytest.raises(ValueError, match="metadata: no steps, time_step, run_seconds"):
        _ = dataclasses.replace(found, metadata={}).timing


def test_names_are_no_markup(tmp_path):
    found = run(tmp_path / "t.h5")
    found.metadata["scene"] = "<script>"
    assert "<script>" not in found._repr_html_() and "&lt;script&gt;" in found._repr_html_()


def test_shown_where_there_are_no_values(tmp_path):
    found, shown = run(tmp_path / "t.h5"), []
    shown.append(repr(jax.tree.map(lambda _: None, found)))
    jax.eval_shape(lambda t: shown.append(repr(t)), found)
    assert "velocity=None" in shown[0] and "velocity=f64[5,256,2]" in shown[1]


def test_plot_shows_the_snapshot_asked_for(tmp_path):
    found = run(tmp_path / "t.h5")
    for time, number in ((None, -1), (0.041, 2)):
        figure = found.plot(time, fields=(FIELDS["pressure"],))
        (squares,) = figure.axes[0].collections
        np.testing.assert_array_equal(squares.get_array(), found.pressure[number])
        assert f"t = {found.time[number]:.4g} s" in figure.axes[0].get_title()


def test_animation_is_that_of_the_file(tmp_path):
    source = random_run(tmp_path / "t.h5", finish=True)
    ours = read_trajectory(source).animate(tmp_path / "ours.gif", every=2, box=read_box(source))
    theirs = animate(source, tmp_path / "theirs.gif", every=2)
    assert ours.read_bytes() == theirs.read_bytes()
    with Image.open(ours) as picture:
        assert picture.n_frames == 3
    with pytest.raises(ValueError, match="every: every 0-th"):
        read_trajectory(source).animate(tmp_path / "none.gif", every=0)


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_a_saved_file_reads_the_same(tmp_path, dtype):
    found = run(tmp_path / "t.h5", dtype=dtype)
    again = read_trajectory(found.save(tmp_path / "new" / "saved.h5"))
    assert same(found, again) and again.metadata == found.metadata
    overview = read_overview(tmp_path / "new" / "saved.h5")
    assert overview.complete
    with pytest.raises(TrajectoryFileError, match="exists"):
        found.save(tmp_path / "new" / "saved.h5")
    found.save(tmp_path / "new" / "saved.h5", overwrite=True)


def test_reduced_coordinates_and_uneven_times_are_saved(tmp_path):
    found = run(tmp_path / "t.h5")
    fields = (found.position, found.velocity, found.density, found.pressure)
    time, coordinates = np.array([0.5, 0.53, 0.58, 0.6, 1.0]), np.arange(15.0).reshape(5, 3)
    own = Trajectory(time, *fields, coordinates)
    assert same(own, read_trajectory(own.save(tmp_path / "own.h5")))
    with pytest.raises(ValueError, match="time: .* increase"):
        Trajectory(time[::-1], *fields).save(tmp_path / "back.h5")
    assert not (tmp_path / "back.h5").exists()


def test_no_run_goes_on_from_a_saved_file(tmp_path):
    path = run(tmp_path / "t.h5").save(tmp_path / "saved.h5")
    with pytest.raises(TrajectoryFileError, match="holds another run"):
        read_checkpoint(path).check(path, {"effects": "3 parts"})


def test_without_xarray_the_error_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)  # cannot be imported
    with pytest.raises(ImportError, match=r"xarray is not there; install .* jaxsph\[xarray\]"):
        run(tmp_path / "t.h5").to_xarray()


def test_without_pyvista_the_error_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyvista", None)  # cannot be imported
    with pytest.raises(ImportError, match=r"pyvista is not there; install .* jaxsph\[pyvista\]"):
        run(tmp_path / "t.h5").to_pyvista()


@pytest.mark.parametrize("dim", [2, 3])
def test_a_point_cloud_has_the_particles_and_their_fields(tmp_path, dim):
    pytest.importorskip("pyvista", reason="pyvista is not installed")
    found = run(tmp_path / "t.h5", dim=dim)
    for time, number in ((None, -1), (float(found.time[1]) + 1e-6, 1)):
        cloud = found.to_pyvista(time)
        assert cloud.n_points == found.particles and cloud.n_verts == found.particles
        assert cloud.field_data["time"] == [found.time[number]]
        for name, values in (("velocity", found.velocity), ("position", found.position)):
            mine = cloud.points if name == "position" else cloud.point_data[name]
            np.testing.assert_array_equal(mine[:, :dim], values[number])
            assert mine.shape[1] == 3 and not mine[:, dim:].any()
        np.testing.assert_array_equal(cloud.point_data["density"], found.density[number])
        np.testing.assert_array_equal(cloud.point_data["pressure"], found.pressure[number])


@pytest.mark.parametrize("dim", [2, 3])
def test_labelled_arrays(tmp_path, dim):
    pytest.importorskip("xarray", reason="xarray is not installed")
    found = run(tmp_path / "t.h5", dim=dim)
    dataset = found.to_xarray()
    assert dataset.velocity.dims == ("time", "particle", "direction")
    np.testing.assert_array_equal(dataset.time, found.time)
    np.testing.assert_array_equal(
        dataset.velocity.sel(direction="y").isel(time=-1), found.velocity[-1, :, 1]
    )
    np.testing.assert_array_equal(dataset.pressure, found.pressure)
    assert dataset.density.attrs["units"] == "kg/m^3" and dataset.time.attrs["units"] == "s"
    assert dataset.attrs["scene"] == found.metadata["scene"]
