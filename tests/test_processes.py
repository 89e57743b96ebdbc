"""Devices of several processes run one simulation together, as one device runs it alone."""

import os
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import jaxsph

from .processes_worker import fault, short

ROOT = Path(__file__).parents[1]
WORKER = Path(__file__).with_name("processes_worker.py")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["vortex", "cavity"])
def test_two_processes_are_one(name, tmp_path):
    """The file that the first of them writes, and what both say of a fault, of a file that cannot
    be, and of a disk that is full."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    path, scene = tmp_path / "run.h5", short(name)
    # as in test_devices.py
    kept = {k: v for k, v in os.environ.items() if k != "JAX_COMPILATION_CACHE_DIR"}
    both = [
        subprocess.Popen(
            [sys.executable, WORKER, address, str(number), name, path], cwd=ROOT, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            env={**kept, "JAX_PLATFORMS": "cpu", "PYTHONPATH": str(ROOT)},
        )
        for number in range(2)
    ]  # fmt: skip
    said = [process.communicate(timeout=600) for process in both]
    assert [process.returncode for process in both] == [0, 0], [e[-2000:] for _, e in said]
    found, wanted = jaxsph.io.read_trajectory(path), jaxsph.run_scene(scene)
    for field in ("position", "velocity", "density"):
        one, other = getattr(wanted, field), getattr(found, field)
        np.testing.assert_allclose(other, one, atol=1e-13 * np.abs(one).max(), rtol=0.0)
    alone = fault(scene)
    assert "particle" in alone
    for output, _ in said:
        of_a_fault, of_the_file, of_the_disk = output.splitlines()[-3:]
        assert of_a_fault == alone
        assert "beside.h5" in of_the_file
        assert of_the_disk.endswith(".full: no room at step 3.")
    assert len(jaxsph.io.read_trajectory(f"{path}.full").time) == 1
