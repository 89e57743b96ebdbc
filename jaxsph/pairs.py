"""The pair sum: sums over neighbours of a function of two particles, with all its derivatives.

    S_i = sum_j g(T_i, T_j)

where T_i is a row of particle fields. This is the one hot loop of the library. Rows of all fields
are gathered at once, a chunk of particles at a time, and all sums leave in one variadic reduction,
because XLA would otherwise turn every sum into a loop of its own and recompute the geometry in
each. The primitive carries its own rules:

- forward mode: the tangent of a pair sum is a pair sum of g's own `jax.jvp`;
- reverse mode: a neighbour list is symmetric, so the transpose is again a pair sum, with the roles
  of the two particles exchanged (gathers only, no scatter);
- batching: a CPU takes members one by one, so that the working set stays in cache, a GPU all at
  once;
- a GPU has a kernel of its own (`pair_sum_on_gpu.py`);
- several devices make each the sums of its own rows (`pair_sum_over_devices.py`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir
from jaxtyping import Array

from . import pair_sum_on_gpu
from .at_ghosts import AtGhost
from .chunks import overlapping_map
from .domain import Box
from .kernels import Kernel
from .neighbors import VerletList, WallPairs
from .pair_derivatives import Linearised, Transposed, replaced
from .pair_sum_over_devices import lowered, without_others
from .vector import Vector

_SLOTS_PER_CHUNK = 120_000  # rows times neighbour slots worked on at a time (measured)
_FINER = 4  # chunks where some rows have no partner


# ------------------------------------------------------------------ what users write


class Pair:
    """Geometry of the pair (i, j), computed at first use and shared by all terms of a sum.

    A pair at zero distance (a free slot of the list, or two particles at one place) counts as
    out of the kernel's support: it adds nothing, nor do its derivatives.
    """

    def __init__(self, space: Space, i, j):
        self._space = space
        self._volume = j.volume
        self.separation = Vector(
            space.box.minimum_image(d, k) for k, d in enumerate(j.position - i.position)
        )  # x_j - x_i

    @cached_property
    def squared_distance(self) -> Array:
        squared = self.separation.dot(self.separation)
        outside = (2.0 * self._space.support) ** 2
        return jnp.where(squared > 0.0, squared, outside)

    @cached_property
    def distance(self) -> Array:
        return jnp.sqrt(self.squared_distance)

    @cached_property
    def kernel(self) -> Array:
        """W_ij."""
        space = self._space
        return space.kernel.value(self.distance, space.smoothing_length, space.box.dim)

    @cached_property
    def radial_slope(self) -> Array:
        """-W'(r) / r V_j, which is (x_j - x_i) . grad_i W_ij V_j / r^2."""
        space = self._space
        slope = space.kernel.gradient_over_r(self.distance, space.smoothing_length, space.box.dim)
        return -slope * self._volume

    @cached_property
    def gradient(self) -> Vector:
        """grad_i W_ij V_j."""
        return self.separation * self.radial_slope


@dataclass(frozen=True)
class Space:
    """Where pairs live: box, kernel, smoothing length h [m] and particle spacing [m]; static."""

    box: Box
    kernel: Kernel
    smoothing_length: float
    spacing: float

    def __post_init__(self):
        for name in ("smoothing_length", "spacing"):  # not numpy's, whose dtype would spread
            object.__setattr__(self, name, float(getattr(self, name)))

    @property
    def support(self) -> float:
        """Radius of the kernel's support [m]."""
        return self.kernel.support * self.smoothing_length

    @property
    def counts(self) -> tuple[int, ...]:
        """Cells of the lattice along each side of the box, whole numbers of about dx."""
        return tuple(max(1, round(length / self.spacing)) for length in self.box.lengths)

    @property
    def steps(self) -> tuple[float, ...]:
        """Sides of such a cell [m]: dx where it divides the box."""
        return tuple(b / count for b, count in zip(self.box.lengths, self.counts, strict=True))

    @property
    def cell_volume(self) -> float:
        """Volume of such a cell [m^n]."""
        return math.prod(self.steps)

    def lattice(self, layers: int = 0) -> np.ndarray:
        """Centres (P, n) [m] of the cells in the box and in layers beyond its closed faces."""
        box = self.box
        cells = zip(box.lower, self.steps, self.counts, box.periodic, strict=True)
        axes = []
        for lower, step, count, periodic in cells:
            more = 0 if periodic else layers
            axes.append(lower + (np.arange(-more, count + more) + 0.5) * step)
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, box.dim)

    def check(self) -> None:
        """Raise a ValueError if a periodic box is too small for the kernel's support."""
        for length, periodic in zip(self.box.lengths, self.box.periodic, strict=True):
            if periodic and length < 2.0 * self.support:
                raise ValueError(
                    f"box: a periodic length of {length:g} m is too small for a kernel support of "
                    f"{self.support:g} m; it needs twice that. Raise the resolution or lower h/dx."
                )

    @cached_property
    def kernel_at_spacing(self) -> float:
        """W(dx)."""
        with jax.ensure_compile_time_eval():
            spacing = jnp.asarray(self.spacing)
            return float(self.kernel.value(spacing, self.smoothing_length, self.box.dim))


@dataclass(frozen=True)
class PairTerm:
    """One named sum: `function(pair, i, j)` gives a scalar or a `Vector` to add up over j.

    `reads` names the fields of particles i and j that the function uses; only those are gathered.
    The function must be hashable by value (a module-level function or a frozen dataclass).

    Where a scene has walls, `ghost` says what a ghost adds: `Same()`, `Mirrored(...)`,
    `Otherwise(...)`, or nothing. A sum over ghosts alone has no `function`.
    """

    name: str
    reads: tuple[str, ...]
    function: Callable | None
    ghost: AtGhost | None = None


def pair_sum(
    terms: tuple[PairTerm, ...],
    fields: Mapping[str, Array],
    space: Space,
    neighbors: VerletList | WallPairs,
    rows: tuple[int, int] | None = None,
) -> dict[str, Array]:
    """All sums of `terms` in one pass over the pairs.

    Args:
        terms: the sums wanted; terms that are equal are computed once.
        fields: per-particle arrays (N,) or (N, k) in the list's sorted order; `position` and
            `volume` among them.
        space: kernel and box.
        neighbors: the list; symmetric, so that sums can be transposed.
        rows: first row wanted and the one past the last, of each device's where several share them;
            all if none are given.

    Returns:
        for each term's name an array (N,), or (N, k) where the term gives a vector, N counting the
        rows wanted.

    Raises:
        ValueError: if two different terms share a name, or a field is missing.
    """
    terms = tuple(dict.fromkeys(terms))
    names = [term.name for term in terms]
    if len(set(names)) < len(names):
        raise ValueError(f"terms: two different terms share a name among {names}; rename one.")
    wanted = dict.fromkeys(("position", "volume") + tuple(f for term in terms for f in term.reads))
    missing = [name for name in wanted if name not in fields]
    if missing:
        raise ValueError(f"fields: {missing} are read by the terms {names} but nothing gives them.")
    layout = tuple(
        (name, fields[name].shape[1] if fields[name].ndim == 2 else 0) for name in wanted
    )
    columns = []
    for name, width in layout:
        columns += [fields[name][:, k] for k in range(width)] if width else [fields[name]]
    function = _Composed(terms, space, layout)
    exchange, count = neighbors.exchange, len(columns[0])
    if exchange is not None:
        columns = [exchange.devices.filled(column) for column in columns]
    outputs = pair_sum_p.bind(
        neighbors.index, *columns, function=function, rows=rows, mapped=(), exchange=exchange
    )
    if exchange is not None and rows is None:
        outputs = exchange.devices.divided([o[:count] for o in outputs])
    sums, start = {}, 0
    for term, width in zip(terms, function.widths(columns[0].dtype), strict=True):
        if width:
            sums[term.name] = jnp.stack(outputs[start : start + width], axis=-1)
        else:
            sums[term.name] = outputs[start]
        start += width or 1
    return sums


@dataclass(frozen=True)
class _Composed:
    """All terms as one function of the columns of i and of j."""

    terms: tuple[PairTerm, ...]
    space: Space
    layout: tuple[tuple[str, int], ...]

    def _named(self, columns):
        columns, named = list(columns), {}
        for name, width in self.layout:
            named[name] = Vector(columns[:width]) if width else columns[0]
            columns = columns[width or 1 :]
        return SimpleNamespace(**named)

    def _values(self, here, there):
        i, j = self._named(here), self._named(there)
        pair = Pair(self.space, i, j)
        for term in self.terms:
            with jax.named_scope(term.name):
                yield term.function(pair, i, j)

    def __call__(self, here, there):
        flat = []
        for value in self._values(here, there):
            flat += list(value) if isinstance(value, Vector) else [value]
        return tuple(flat)

    def widths(self, dtype) -> tuple[int, ...]:
        """Components of each term's value, 0 for a scalar."""
        found = []

        def probe(*columns):
            values = list(self._values(columns, columns))
            found.extend(len(v) if isinstance(v, Vector) else 0 for v in values)

        count = sum(width or 1 for _, width in self.layout)
        jax.eval_shape(probe, *[jax.ShapeDtypeStruct((1, 1), dtype)] * count)
        return tuple(found)


# ------------------------------------------------------------------ the primitive

pair_sum_p = Primitive("pair_sum")
pair_sum_p.multiple_results = True


def _evaluate(index, *columns, function, rows):
    """Gather the neighbours' columns a chunk of rows at a time, reduce all sums in one loop.

    Where rows are chosen, among them those without a partner, a chunk of such rows is passed over.
    """
    wanted = slice(*(rows or (len(index),)))

    def sums(block):
        here, neighbors = block
        i = [jnp.broadcast_to(column[:, None], neighbors.shape) for column in here]
        j = [
            column.at[neighbors].get(mode="promise_in_bounds", wrap_negative_indices=False)
            for column in columns
        ]
        values = [jnp.broadcast_to(v, neighbors.shape) for v in function(i, j)]
        zeros = tuple(jnp.zeros((), v.dtype) for v in values)
        return lax.reduce(
            tuple(values), zeros, lambda a, b: tuple(x + y for x, y in zip(a, b, strict=True)), (1,)
        )

    def sums_of_some(block):
        here, neighbors, own = block
        block = here, neighbors
        zeros = [jnp.zeros(a.shape, a.dtype) for a in jax.eval_shape(sums, block)]
        alone = jnp.all(neighbors == own[:, None])
        return lax.cond(alone, lambda _: tuple(zeros), lambda b: tuple(sums(b)), block)

    here = tuple(column[wanted] for column in columns)
    if rows is None:
        chunk = max(1, _SLOTS_PER_CHUNK // index.shape[1])
        return list(overlapping_map(sums, (here, index), chunk))
    chunk = max(1, _SLOTS_PER_CHUNK // (_FINER * index.shape[1]))
    own = jnp.arange(*rows, dtype=index.dtype)
    return list(overlapping_map(sums_of_some, (here, index[wanted], own), chunk))


def _one_by_one(index, *columns, function, rows, mapped):
    """Of each member; `mapped` are the places of the arguments that have a leading axis of them."""
    arguments = index, *columns

    def member(own):
        return tuple(_evaluate(*replaced(arguments, mapped, own), function=function, rows=rows))

    return list(lax.map(member, [arguments[k] for k in mapped]) if mapped else member([]))


def _abstract(index, *columns, function, rows, mapped, exchange):
    probe = [jax.ShapeDtypeStruct((1, 1), c.dtype) for c in columns]
    outputs = jax.eval_shape(lambda *c: function(c, c), *probe)
    shares = 1 if exchange is None else exchange.devices.count
    count = index.shape[-2] if rows is None else shares * (rows[1] - rows[0])
    members = [(index, *columns)[k].shape[0] for k in mapped[:1]]
    return [jax.core.ShapedArray((*members, count), o.dtype) for o in outputs]


def _jvp(primals, tangents, *, function, mapped, **same):
    _, *columns = primals
    active = tuple(k for k, t in enumerate(tangents[1:]) if type(t) is not ad.Zero)
    outputs = pair_sum_p.bind(*primals, function=function, mapped=mapped, **same)
    if not active:
        return outputs, [ad.Zero.from_primal_value(o) for o in outputs]
    linear = Linearised(function, active, len(columns))
    moved = [tangents[1 + k] for k in active]
    mapped += tuple(k for k, a in enumerate(active, len(primals)) if 1 + a in mapped)
    return outputs, pair_sum_p.bind(*primals, *moved, function=linear, mapped=mapped, **same)


def _transpose(cotangents, index, *columns, function, rows, mapped, exchange):
    primals = columns[: function.count]
    linear = columns[function.count :]
    if any(map(ad.is_undefined_primal, primals)) or not all(map(ad.is_undefined_primal, linear)):
        raise NotImplementedError("a pair sum is linear in its tangent columns only")
    if isinstance(function, Linearised):
        flipped = Transposed(function.function, function.active, function.count)
    else:
        flipped = Linearised(function.function, function.active, function.count)
    cotangents = [ad.instantiate_zeros(c) for c in cotangents]
    if rows is not None:  # a sum that was not wanted has no cotangent
        cotangents = without_others(cotangents, rows, index.shape[-2], exchange)
    start = 1 + function.count
    own = tuple(k for k in mapped if k < start)
    every = tuple(range(start, start + len(cotangents))) if mapped else ()
    outputs = pair_sum_p.bind(
        index, *primals, *cotangents, function=flipped, rows=None, mapped=own + every,
        exchange=exchange,
    )  # fmt: skip
    outputs = [  # what members share has a share of each
        jnp.sum(o, axis=0) if mapped and k not in mapped else o
        for k, o in enumerate(outputs, start)
    ]
    return [None] * start + outputs


def _batch(arguments, axes, *, mapped, **same):
    moved = [
        a if axis is None else jnp.moveaxis(a, axis, 0)
        for a, axis in zip(arguments, axes, strict=True)
    ]
    new = tuple(k for k, axis in enumerate(axes) if axis is not None)
    if not mapped:
        outputs = pair_sum_p.bind(*moved, mapped=new, **same)
        return outputs, [0] * len(outputs)

    def member(own):
        arguments = replaced(moved, new, own)
        return tuple(pair_sum_p.bind(*arguments, mapped=mapped, **same))

    outputs = lax.map(member, [moved[k] for k in new])
    return list(outputs), [0] * len(outputs)


pair_sum_p.def_impl(
    jax.jit(pair_sum_p.bind, static_argnames=("function", "rows", "mapped", "exchange"))
)
pair_sum_p.def_abstract_eval(_abstract)
mlir.register_lowering(pair_sum_p, lowered(pair_sum_p, mlir.lower_fun(_one_by_one)))
mlir.register_lowering(pair_sum_p, lowered(pair_sum_p, pair_sum_on_gpu.lower), platform="cuda")
ad.primitive_jvps[pair_sum_p] = _jvp
ad.primitive_transposes[pair_sum_p] = _transpose
batching.primitive_batchers[pair_sum_p] = _batch
