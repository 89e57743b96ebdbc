"""What is written for ParaView, read back by the library that ParaView reads with."""

import tracemalloc

import h5py
import numpy as np
import pytest

from jaxsph.io import TrajectoryFileError, read_trajectory, write_vtkhdf
from tests.runs import random_run

FIELDS = ("velocity", "density", "pressure")


def read_back(path):
    """Times, and at each of them positions, fields and vertices, by VTK's own reader."""
    reading = pytest.importorskip("vtkmodules.vtkIOHDF", reason="vtk is not installed")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline

    reader = reading.vtkHDFReader()
    assert reader.CanReadFile(str(path))
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(Pipeline.TIME_STEPS())
    shots = []
    for time in times:
        reader.UpdateTimeStep(time)
        found = reader.GetOutputDataObject(0)
        assert found.GetClassName() == "vtkPolyData"
        data = found.GetPointData()
        fields = {
            data.GetArrayName(k): vtk_to_numpy(data.GetArray(k)).copy()
            for k in range(data.GetNumberOfArrays())
        }
        vertices = vtk_to_numpy(found.GetVerts().GetConnectivityArray())
        assert found.GetNumberOfCells() == found.GetNumberOfVerts() == len(vertices)
        np.testing.assert_array_equal(vertices, np.arange(found.GetNumberOfPoints()))
        shots.append((vtk_to_numpy(found.GetPoints().GetData()).copy(), fields))
    return np.array(times), shots


@pytest.mark.parametrize(
    "dim, dtype, every", [(2, "float64", 1), (2, "float32", 2), (3, "float64", 3)]
)
def test_vtk_reads_what_was_written(tmp_path, dim, dtype, every):
    source = random_run(tmp_path / "t.h5", dim=dim, dtype=dtype)
    written = []
    path = write_vtkhdf(source, tmp_path / "new" / "t.vtkhdf", every=every, progress=written.append)
    run = read_trajectory(source)
    times, shots = read_back(path)
    np.testing.assert_array_equal(times, run.time[::every])
    assert sum(written) == len(times) == len(shots)
    for k, (position, fields) in enumerate(shots):
        np.testing.assert_array_equal(position[:, :dim], run.position[k * every])
        np.testing.assert_array_equal(fields["velocity"][:, :dim], run.velocity[k * every])
        assert position.dtype == fields["pressure"].dtype == np.dtype(dtype)
        for name in ("density", "pressure"):
            np.testing.assert_array_equal(fields[name], getattr(run, name)[k * every])
        if dim == 2:
            assert not position[:, 2].any() and not fields["velocity"][:, 2].any()


def test_layout_and_units(tmp_path):
    path = write_vtkhdf(random_run(tmp_path / "t.h5"), tmp_path / "t.vtkhdf", ["pressure"])
    with h5py.File(path) as file:
        root = file["VTKHDF"]
        assert tuple(root.attrs["Version"]) == (2, 0) and root.attrs["Type"] == b"PolyData"
        assert list(root["PointData"]) == ["pressure"]
        assert root["PointData/pressure"].attrs["unit"] == "Pa"
        assert root["Points"].attrs["unit"] == "m" and root.attrs["units"] == "SI"
        assert root["Points"].shape == (5 * 256, 3) and root["Steps"].attrs["NSteps"] == 5
        np.testing.assert_array_equal(root["Steps/PointOffsets"], 256 * np.arange(5))
        assert len(root["Vertices/Connectivity"]) == 256  # once for all times
    assert sorted(p.name for p in tmp_path.iterdir()) == ["t.h5", "t.vtkhdf"]


def test_one_snapshot_is_held_at_a_time(tmp_path):
    source = random_run(tmp_path / "t.h5", count=50)
    write_vtkhdf(source, tmp_path / "t.vtkhdf")  # h5py's own caches
    tracemalloc.start()
    try:
        write_vtkhdf(source, tmp_path / "t.vtkhdf")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    whole = 50 * 256 * 6 * 8
    assert peak < 0.3 * whole  # one snapshot is 0.02 of it; Python's own objects are the rest


def test_bad_input(tmp_path):
    source = random_run(tmp_path / "t.h5")
    target = tmp_path / "t.vtkhdf"
    with pytest.raises(ValueError, match="fields: speed is not known; choose of velocity"):
        write_vtkhdf(source, target, ["speed"])
    with pytest.raises(ValueError, match="give at least 1"):
        write_vtkhdf(source, target, every=0)
    with pytest.raises(ValueError, match="is the trajectory itself"):
        write_vtkhdf(source, source)
    with pytest.raises(TrajectoryFileError, match="no such file"):
        write_vtkhdf(tmp_path / "missing.h5", target)
    with pytest.raises(TrajectoryFileError, match="holds no snapshot yet"):
        write_vtkhdf(random_run(tmp_path / "empty.h5", count=0), target)
    assert not target.exists()
