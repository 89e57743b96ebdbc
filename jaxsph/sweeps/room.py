"""Whether a compiled program fits into its device, asked before anything is given to it."""

from __future__ import annotations

from typing import Protocol

_GIB = 2.0**30


class Device(Protocol):
    """What is asked of a device; a CPU tells nothing."""

    def memory_stats(self) -> dict[str, int] | None: ...


def check_room(program, device: Device, batch: int) -> None:
    """A ValueError if the members that a device is to run side by side need more than it has free.

    Args:
        program: compiled; it knows its arguments, results and what it needs between.
        device: that runs it.
        batch: members of it.
    """
    stats = device.memory_stats() or {}
    if "bytes_limit" not in stats:
        return
    sizes = program.memory_analysis()
    need = (
        sizes.argument_size_in_bytes + sizes.output_size_in_bytes - sizes.alias_size_in_bytes
    ) + sizes.temp_size_in_bytes
    free = stats["bytes_limit"] - stats.get("bytes_in_use", 0)
    if need > free:
        fitting = int(batch * free / need)
        advice = f"batch={fitting} should fit" if fitting else "make the scenes smaller"
        raise ValueError(
            f"batch: {batch} members side by side need {need / _GIB:.2f} GiB on each device, and "
            f"{free / _GIB:.2f} GiB are free; {advice}."
        )
