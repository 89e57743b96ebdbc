"""What a result was computed with and on."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import jax

from .version import __version__

_PACKAGES = ("jax", "jaxlib", "numpy", "equinox", "h5py")


def environment() -> dict[str, dict[str, Any]]:
    """Versions, machine and device, JSON-like, with no names of hosts, users or folders."""
    device = jax.devices()[0]
    return {
        "versions": versions(),
        "machine": {"system": platform.system(), "processor": _processor(), "cores": _cores()},
        "device": {"platform": device.platform, "kind": device.device_kind},
    }


def versions() -> dict[str, str]:
    """Versions of this library, of Python and of the packages that numbers depend on."""
    found = {"jaxsph": __version__, "python": platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "unknown"
    return found


def _processor() -> str:
    """The processor's model name where the system tells it, else its architecture."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    for line in lines:
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _cores() -> int:
    """Cores this process may use."""
    if hasattr(os, "sched_getaffinity"):  # not on every system
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
