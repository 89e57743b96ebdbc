"""Starts without sound, as models on reference points need them."""

from __future__ import annotations

from jaxsph.scenes import Scene, balanced

from .recorded_run import with_record


def quiet(scene: Scene) -> Scene:
    """The periodic scene at a balanced pressure, which its record tells.

    Raises:
        ValueError: as `balanced`.
    """
    return with_record(balanced(scene), start="balanced")
