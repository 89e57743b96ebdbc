"""How each of several devices comes by the rows of others that its sums read."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import final

import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Bool, Int

from .devices import AXIS, Devices


class Exchange(ABC):
    """What a device sees of a table of R rows of which each device has an equal run.

    Its window has its own rows first, then those that come after them and, last, those before them,
    round the table's end. Places in a list count in that order: of the window, or of all R rows.
    """

    devices: Devices

    @abstractmethod
    def window(self, table: Array) -> Array:
        """Columns (F, share) of a device's own rows -> those of its window. Within `each`."""

    @abstractmethod
    def seen(
        self, place: Int[Array, "..."], rows: int
    ) -> tuple[Int[Array, "..."], Bool[Array, "..."]]:
        """Places among all `rows`, as places in the window, and which of them are in it."""

    @abstractmethod
    def among_all(self, place: Int[Array, "..."], rows: int) -> Int[Array, "..."]:
        """The converse: places in the window as places among all `rows`."""

    @abstractmethod
    def sent(self, rows: int) -> int:
        """Rows that a device is sent of a table of so many, for each time that it is read."""


@final
@dataclass(frozen=True)
class Gathered(Exchange):
    """All rows of all devices: what is sent does not fall as devices are added.

    Args:
        devices: that share the rows.
    """

    devices: Devices

    def window(self, table):
        whole = lax.all_gather(table, AXIS, axis=1, tiled=True)
        return jnp.roll(whole, -self.devices.number() * table.shape[1], axis=1)

    def seen(self, place, rows):
        return place, jnp.ones(place.shape, bool)

    def among_all(self, place, rows):
        return place

    def sent(self, rows):
        return rows - self.devices.share(rows)


@final
@dataclass(frozen=True)
class Halo(Exchange):
    """The rows next to a device's own, so many on either side, round the table's end.

    They come from the device before and the one after; where these have fewer, from those beyond as
    well.

    Args:
        devices: that share the rows.
        depth: rows on either side.
    """

    devices: Devices
    depth: int

    def window(self, table):
        share, ring = table.shape[1], range(self.devices.count)
        before, after = [], []
        for hop in range(1, -(-self.depth // share) + 1):
            wide = min(share, self.depth - (hop - 1) * share)
            onward = [(k, (k + hop) % len(ring)) for k in ring]
            back = [(there, here) for here, there in onward]
            before.append(lax.ppermute(table[:, share - wide :], AXIS, onward))
            after.append(lax.ppermute(table[:, :wide], AXIS, back))
        window = jnp.concatenate([table, *after, *before[::-1]], axis=1)
        # A particle's own place is a free slot of its row: both must be the same number. Were own
        # columns not read in the window but computed once more, they could be rounded otherwise.
        return lax.optimization_barrier(window)

    def seen(self, place, rows):
        ahead, left_out = self._split(rows)
        inside = (place < ahead) | (place >= ahead + left_out)
        return jnp.where(place < ahead, place, place - left_out), inside

    def among_all(self, place, rows):
        ahead, left_out = self._split(rows)
        return jnp.where(place < ahead, place, place + left_out)

    def sent(self, rows):
        return 2 * self.depth

    def _split(self, rows: int) -> tuple[int, int]:
        """Rows of a window up to the last one after its own, and rows that are not in it."""
        ahead = self.devices.share(rows) + self.depth
        return ahead, rows - ahead - self.depth


def least(devices: Devices, rows: int, depth: int) -> Exchange:
    """The exchange that sends least of a table of so many rows, `depth` of them next to its own
    being what a device reads."""
    halo, gathered = Halo(devices, depth), Gathered(devices)
    return halo if halo.sent(rows) < gathered.sent(rows) else gathered
