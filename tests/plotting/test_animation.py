"""Moving pictures: as many frames as asked for, the same scale in all of them."""

import contextlib
import itertools
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from jaxsph.io import read_trajectory
from jaxsph.plotting import FIELDS, animate, animation
from tests.runs import random_run


@pytest.mark.parametrize("dim, every, frames", [(2, 1, 5), (3, 2, 3)])
def test_gif(tmp_path, dim, every, frames):
    path, drawn = tmp_path / "new" / "t.gif", []
    source = random_run(tmp_path / "t.h5", dim=dim)
    assert animate(source, path, FIELDS["pressure"], every, 10, drawn.append) == path
    with Image.open(path) as picture:
        assert (picture.n_frames, picture.format) == (frames, "GIF")
        shots = []
        for k in range(frames):
            picture.seek(k)
            assert picture.info["duration"] == 100  # ms
            shots.append(np.asarray(picture.convert("RGB"), int))
    assert sum(drawn) == frames
    assert all(np.any(a != b) for a, b in itertools.pairwise(shots))  # something moves
    assert [p.name for p in path.parent.iterdir()] == ["t.gif"]


class Watch:
    """Stands in for a writer; notes what each frame shows."""

    def __init__(self):
        self.frames = []

    @contextlib.contextmanager
    def saving(self, figure, path, dpi):
        Path(path).touch()
        self.axes = figure.axes[0]
        yield

    def grab_frame(self):
        (squares,) = self.axes.collections
        scale = (self.axes.get_xlim(), self.axes.get_ylim(), squares.get_clim())
        self.frames.append(
            (self.axes.get_title(), scale, squares.get_offsets().data, squares.get_array().data)
        )


def test_frames_show_the_snapshots_on_one_scale(tmp_path, monkeypatch):
    watch = Watch()
    monkeypatch.setitem(animation._WRITERS, ".gif", lambda fps: (watch, {}))
    source = random_run(tmp_path / "t.h5")
    run = read_trajectory(source)
    animate(source, tmp_path / "t.gif", FIELDS["density"], every=2)
    titles, scales, positions, values = zip(*watch.frames, strict=True)
    interval = run.time[2]
    assert titles == tuple(f"taylor-green, t = {k * interval:.3f} s" for k in range(3))
    assert all(len(frame) > 256 for frame in positions)  # images stand behind the particles
    np.testing.assert_array_equal([frame[:256] for frame in positions], run.position[::2])
    np.testing.assert_array_equal([frame[:256] for frame in values], run.density[::2])
    assert len(set(scales)) == 1
    across, up, colours = scales[0]
    shown = run.position[::2]
    assert across[0] < shown[..., 0].min() and shown[..., 0].max() < across[1]
    assert up[0] < shown[..., 1].min() and shown[..., 1].max() < up[1]
    outside = (run.density[::2] < colours[0]) | (run.density[::2] > colours[1])
    assert 0.01 < outside.mean() < 0.03  # one percent at each end


def test_mp4(tmp_path):
    source, path = random_run(tmp_path / "t.h5"), tmp_path / "t.mp4"
    try:
        animation._ffmpeg()
    except ValueError:
        pytest.skip("ffmpeg is not installed")
    animate(source, path)
    assert path.read_bytes()[4:8] == b"ftyp"  # as ISO media files begin
    seen = subprocess.run([animation._ffmpeg(), "-i", path], capture_output=True, text=True).stderr
    assert "Video: h264" in seen and "15 fps" in seen


def test_without_ffmpeg_one_line_says_so(tmp_path, monkeypatch):
    source = random_run(tmp_path / "t.h5")
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)  # cannot be imported
    with pytest.raises(ValueError, match=r"ffmpeg, .* is not there; .* jaxsph\[movie\], or .*gif"):
        animate(source, tmp_path / "t.mp4")
    assert [p.name for p in tmp_path.iterdir()] == ["t.h5"]


def test_bad_input(tmp_path):
    source = random_run(tmp_path / "t.h5")
    with pytest.raises(ValueError, match="end with .gif or .mp4"):
        animate(source, tmp_path / "t.avi")
    with pytest.raises(ValueError, match="frames_per_second: 0"):
        animate(source, tmp_path / "t.gif", frames_per_second=0)
    with pytest.raises(ValueError, match="every: "):
        animate(source, tmp_path / "t.gif", every=0)
    assert [p.name for p in tmp_path.iterdir()] == ["t.h5"]
