"""Starts without sound, as models on reference points need them."""

from __future__ import annotations

from jaxsph.scenes import Scene, balanced

from .recorded_run import with_record


def quiet(scene: Scene, near: Scene | None = None) -> Scene:
    """The periodic scene at a balanced pressure, which its record tells.

    Args:
        scene: to start.
        near: a quiet one like it, which saves most of the time.

    Raises:
        ValueError: as `balanced`.
    """
    return with_record(balanced(scene, near=near), start="balanced")
