"""Models and predictions on a disk that takes no more: one error, and no half file."""

import numpy as np
import pytest

from jaxsph.io import TrajectoryFileError
from jaxsph_rom.points.files.whole_file import read_whole, write_whole
from tests.io.test_full_disk import SIZES, full_at

KIND = ("jaxsph reduced flow", 1)
LAYOUT = {"modes": ("points modes", "1"), "starts": ("runs modes", "coordinate")}
ARRAYS = {"modes": np.arange(4000.0).reshape(1000, 4), "starts": np.ones((3, 4))}


@pytest.mark.parametrize("size", SIZES)
def test_a_full_disk_is_one_error(tmp_path, size):
    path = tmp_path / "model.h5"
    write_whole(path, KIND, LAYOUT, ARRAYS, {"scene": "before"})
    other = {**ARRAYS, "starts": np.zeros((3, 4))}
    with full_at(size), pytest.raises(TrajectoryFileError, match="cannot be written .File too"):
        write_whole(path, KIND, LAYOUT, other, {"scene": "after"})
    assert [p.name for p in tmp_path.iterdir()] == ["model.h5"]

    def found():
        return read_whole(path, KIND, LAYOUT, "", lambda attributes, arrays, _: (
            attributes["scene"], float(arrays["starts"].sum())))  # fmt: skip

    assert found() == ("before", 12.0)
    write_whole(path, KIND, LAYOUT, other, {"scene": "after"})
    assert found() == ("after", 0.0)
