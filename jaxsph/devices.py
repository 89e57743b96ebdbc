"""Several devices that run one simulation together, each its share of the rows of all arrays."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.sharding import Mesh, NamedSharding
from jax.sharding import PartitionSpec as Spec
from jaxtyping import Array

AXIS = "particles"
_LONGEST = 2048  # bytes that one process tells the others


@dataclass(frozen=True)
class Devices:
    """Devices over which the particles and the neighbour list of one simulation are divided.

    R rows are divided into equal runs of ceil(R / P), one for each of P devices; the last runs may
    be short or empty, so any number of particles will do. A device lists the neighbours of its own
    rows and makes their sums; what these read of other rows is exchanged (`exchange.py`).

    Args:
        every: the devices; all of one kind.

    Raises:
        ValueError: if there is none, something else stands there, one stands there twice, or they
            are of several kinds.

    Examples:
        >>> import jax
        >>> import jaxsph
        >>> jaxsph.Devices(jax.devices()[:1]).share(1000)  # rows of each
        1000
    """

    every: tuple[jax.Device, ...]

    def __post_init__(self):
        if not isinstance(self.every, Iterable):
            raise ValueError(f"devices: got {self.every}; give a sequence, as jax.devices().")
        object.__setattr__(self, "every", tuple(self.every))
        if not all(isinstance(device, jax.Device) for device in self.every):
            raise ValueError(f"devices: got {self.every}; give devices, as jax.devices().")
        if not self.every:
            raise ValueError("devices: got none; give at least one, as jax.devices().")
        if len(set(self.every)) < len(self.every):
            raise ValueError(f"devices: one stands there twice in {self.every}; name each once.")
        kinds = sorted({device.platform for device in self.every})
        if len(kinds) > 1:
            raise ValueError(f"devices: got kinds {', '.join(kinds)}; give devices of one kind.")

    @classmethod
    def first(cls, count: int) -> Devices:
        """The first so many that JAX has.

        Raises:
            ValueError: if it has fewer.
        """
        found = jax.devices()
        if count > len(found):
            kind = found[0].platform
            advice = (
                f"set XLA_FLAGS=--xla_force_host_platform_device_count={count} to divide a CPU"
                if kind == "cpu"
                else f"ask for at most {len(found)}"
            )
            has = f"JAX has {len(found)} ({kind})"
            raise ValueError(f"devices: asked for {count}, {has}; {advice}.")
        return cls(found[:count])

    @property
    def count(self) -> int:
        return len(self.every)

    @cached_property
    def mesh(self) -> Mesh:
        return Mesh(np.asarray(self.every), (AXIS,))

    @property
    def processes(self) -> int:
        """To so many they belong (`jax.distributed`), which all do the same."""
        return len({device.process_index for device in self.every})

    @property
    def write_here(self) -> bool:
        """Whether this process is the one of theirs that writes files: the first."""
        return jax.process_index() == min(device.process_index for device in self.every)

    def warn_of_kept_programs(self) -> None:
        """Warn where XLA may stop for good: parts of a CPU that run programs which are kept."""
        kept = jax.config.jax_compilation_cache_dir and jax.config.jax_enable_compilation_cache
        if kept and self.count > 1 and self.every[0].platform == "cpu":
            warnings.warn(
                "devices: JAX's compilation cache is on, and programs that it keeps have stopped "
                "in exchanges between parts of one CPU; leave it off there (unset "
                "JAX_COMPILATION_CACHE_DIR).",
                stacklevel=3,
            )

    def meet(self) -> None:
        """Wait until all their processes have come there."""
        self.by_first(lambda: None)

    def by_first(self, work: Callable[[], Any]) -> Any:
        """What `work` gives, done by the process that writes files; None in their others, which
        wait for it.

        Raises:
            Exception: what it raises; a ValueError that says the same in the others.
        """
        if self.processes == 1:
            return work()
        found, failure = None, None
        if self.write_here:
            try:
                found = work()
            except Exception as error:
                failure = error
        why = self._told("" if failure is None else str(failure) or repr(failure))
        if failure is not None:
            raise failure
        if why:
            raise ValueError(why)
        return found

    def _told(self, text: str) -> str:
        """The text of the process that writes files, in all of theirs."""
        own = np.frombuffer(text.encode()[:_LONGEST].ljust(_LONGEST, b"\0"), np.uint8)
        shape, sharding = (self.count, _LONGEST), self._sharding(Spec(AXIS))
        of_each = jax.make_array_from_callback(shape, sharding, lambda at: own[None])
        first = min(range(self.count), key=lambda k: self.every[k].process_index)
        told = np.asarray(self.whole(of_each))[first].tobytes().rstrip(b"\0")
        return told.decode(errors="ignore")

    def known(self, tree: Any) -> Any:
        """The same arrays, so that this process has all of them to read."""
        return self.whole(tree) if self.processes > 1 else tree

    def __iter__(self) -> Iterator[jax.Device]:
        return iter(self.every)

    def share(self, rows: int) -> int:
        """Rows of each device, of so many."""
        return -(-rows // self.count)

    def placed(self, tree: Any) -> Any:
        """Arrays given to the devices: by rows where these divide evenly, else whole to each, for
        a program to divide."""

        def put(a):
            even = a.ndim and a.shape[0] % self.count == 0
            return jax.device_put(a, self._sharding(Spec(AXIS) if even else Spec()))

        return jax.tree.map(put, tree)

    @partial(jax.jit, static_argnums=0, inline=True)  # outside programs rows divide evenly or not
    def divided(self, tree: Any) -> Any:
        """The same arrays, each device holding its rows."""
        return lax.with_sharding_constraint(tree, self._sharding(Spec(AXIS)))

    @partial(jax.jit, static_argnums=0, inline=True)
    def whole(self, tree: Any) -> Any:
        """The same arrays, each device holding all of them."""
        return lax.with_sharding_constraint(tree, self._sharding(Spec()))

    @partial(jax.jit, static_argnums=0, inline=True)
    def take(self, field: Array, places: Array) -> Array:
        """Rows of a field by their places, which are all different."""
        whole = self.whole(field)
        return self.divided(whole.at[places].get(mode="promise_in_bounds", unique_indices=True))

    def rows_for_all(self, field: Array, places: Array) -> Array:
        """Rows of a divided field by their places, its last row for places beyond; all of them on
        each device, and no others sent."""
        last, filled = len(field) - 1, self.filled(field)

        def own(part, places):
            place = jnp.minimum(places, last) - self.number() * len(part)
            mine = (place >= 0) & (place < len(part))
            mine = mine.reshape(-1, *[1] * (part.ndim - 1))
            return self.sum(jnp.where(mine, part.at[place].get(mode="clip"), 0))

        return self.each(own, (0, None), None)(filled, places)

    def rows_of_all(self, values: Array, places: Array, count: int) -> Array:
        """A divided field of `count` rows with values, themselves divided, at some different places
        and zero elsewhere; places beyond are left out."""
        share = self.share(count)

        def own(values, places):
            values = lax.all_gather(values, AXIS, tiled=True)
            place = places - self.number() * share
            place = jnp.where((place >= 0) & (places < count), place, share)
            return jnp.zeros((share, *values.shape[1:]), values.dtype).at[place].set(
                values, mode="drop"
            )

        return self.divided(self.each(own, (0, None), 0)(values, places)[:count])

    def filled(self, field: Array, value: Any = 1) -> Array:
        """A field with rows of a value up to equal shares."""
        beyond = self.share(len(field)) * self.count - len(field)
        along = [(0, beyond)] + [(0, 0)] * (field.ndim - 1)
        return self.divided(jnp.pad(field, along, constant_values=value))

    def beside(self, *fields: Array) -> Array:
        """One field of several with equal shares: each device its rows of the first, of the second
        and so on."""
        parts = [f.reshape(self.count, -1, *f.shape[1:]) for f in fields]
        joined = jnp.concatenate(parts, axis=1)
        return self.divided(joined.reshape(-1, *joined.shape[2:]))

    def each(self, function: Callable, given: Sequence[Any], out: Any) -> Callable:
        """`function` run by each device on its own part of its arguments.

        Args:
            function: of the parts.
            given: for each argument the axis of its arrays that is divided, None if all of it goes
                to each device.
            out: the same of what it returns, or one for all of that.
        """

        def specs(axes):
            along = lambda axis: Spec() if axis is None else Spec(*[None] * axis, AXIS)  # noqa: E731
            return jax.tree.map(along, axes, is_leaf=lambda axis: axis is None)

        return jax.shard_map(
            function,
            mesh=self.mesh,
            in_specs=specs(tuple(given)),
            out_specs=specs(out),
            check_vma=False,
        )

    def number(self) -> Array:
        """Which device this one is. Within `each`."""
        return lax.axis_index(AXIS)

    def largest(self, value: Array) -> Array:
        """The largest of all devices. Within `each`."""
        return lax.pmax(value, AXIS)

    def sum(self, value: Array) -> Array:
        """The sum of those of all devices. Within `each`."""
        return lax.psum(value, AXIS)

    def _sharding(self, spec: Spec) -> NamedSharding:
        return NamedSharding(self.mesh, spec)
