"""What of a scene's operators changes from scene to scene, as a few numbers."""

from __future__ import annotations

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxsph import SPHFunctional

_ROUND_OFF = 1e3  # times the precision: leaves that are nearer are the same


class Coefficient(eqx.Module):
    """An array of the functional that changes along some directions:

        leaf = base + sum_k theta_k d_k,    theta_k = <leaf, d_k>,

    so that theta of a number is the number itself. Arrays that are always equal, as a force that
    two effects hold, are one coefficient.

    Args:
        places: of the array in the functional (static).
        base: the part that no direction reaches.
        directions: orthonormal (K, *shape).
    """

    places: tuple[str, ...] = eqx.field(static=True)
    base: Float[Array, "*shape"]
    directions: Float[Array, " *count_and_leaf"]

    def values(self, leaf: Float[Array, "*shape"]) -> Float[Array, " count"]:
        """theta."""
        return jnp.tensordot(self.directions, leaf, leaf.ndim)

    def leaf(self, values: Float[Array, " count"]) -> Float[Array, "*shape"]:
        """The array of these numbers."""
        return self.base + jnp.tensordot(values, self.directions, 1)


class Coefficients(eqx.Module):
    """All that changes, as one vector theta (K,).

    Args:
        parts: a coefficient each.
    """

    parts: tuple[Coefficient, ...]

    @property
    def size(self) -> int:
        return sum(len(part.directions) for part in self.parts)

    @property
    def names(self) -> tuple[str, ...]:
        """A name for each number: where it stands first."""
        names = []
        for part in self.parts:
            name, count = part.places[0].lstrip("."), len(part.directions)
            names += [name] if count == 1 else [f"{name}, direction {k}" for k in range(count)]
        return tuple(names)

    @classmethod
    def between(cls, functionals: Sequence[SPHFunctional]) -> Coefficients:
        """What differs between functionals of one structure."""
        leaves = [arrays_of(functional) for functional in functionals]
        parts: dict[bytes, Coefficient] = {}
        for place in leaves[0]:
            stack = np.stack([np.asarray(found[place]) for found in leaves])
            if (stack == stack[:1]).all():
                continue
            key = stack.tobytes()
            if key in parts:
                old = parts[key]
                parts[key] = Coefficient((*old.places, place), old.base, old.directions)
            else:
                parts[key] = _spanned(place, stack)
        return cls(tuple(parts.values()))

    @classmethod
    def named(cls, functional: SPHFunctional, field: str) -> Coefficients:
        """The numbers that effects have in a field of that name, taken for one."""
        found = {p: a for p, a in arrays_of(functional).items() if p.endswith(f".{field}")}
        if not found:
            return cls(())
        dtype = next(iter(found.values())).dtype
        part = Coefficient(tuple(found), jnp.zeros((), dtype), jnp.ones(1, dtype))
        return cls((part,))

    def values(self, functional: SPHFunctional) -> Float[Array, " coefficients"]:
        """theta of a functional."""
        leaves = arrays_of(functional)
        found = [part.values(leaves[part.places[0]]) for part in self.parts]
        return jnp.concatenate(found) if found else jnp.zeros(0, functional.mass.dtype)

    def applied(
        self, functional: SPHFunctional, values: Float[Array, " coefficients"]
    ) -> SPHFunctional:
        """The functional with these numbers in it; a single one may be given as it is."""
        values = jnp.atleast_1d(values)
        new, first = {}, 0
        for part in self.parts:
            count = len(part.directions)
            leaf = part.leaf(values[first : first + count])
            new |= dict.fromkeys(part.places, leaf)
            first += count
        flat, structure = jax.tree_util.tree_flatten_with_path(functional)
        leaves = [new.get(jax.tree_util.keystr(path), leaf) for path, leaf in flat]
        return jax.tree.unflatten(structure, leaves)

    def at_ghosts(self, seen: Int[np.ndarray, " seen"]) -> Coefficients:
        """The same of a functional that keeps some ghosts of its walls only."""

        def kept(part):
            if not part.places[0].startswith(".walls"):
                return part
            base, directions = np.asarray(part.base)[seen], np.asarray(part.directions)[:, seen]
            return Coefficient(part.places, jnp.asarray(base), jnp.asarray(directions))

        return Coefficients(tuple(map(kept, self.parts)))

    def check(self, functional: SPHFunctional, base: SPHFunctional, what: str) -> None:
        """A ValueError if a functional differs from `base` in more than the coefficients."""
        leaves, wanted = (
            arrays_of(f) for f in (functional, self.applied(base, self.values(functional)))
        )
        for place, found in leaves.items():
            apart = np.abs(np.asarray(found - wanted[place]))
            largest = np.abs(np.asarray(wanted[place])).max(initial=0.0)
            if (apart > _ROUND_OFF * jnp.finfo(found.dtype).eps * largest).any():
                raise ValueError(
                    f"{what}: the scene's {place.lstrip('.')} is none that the training scenes "
                    "span; train on scenes that change it so."
                )


def arrays_of(functional: SPHFunctional) -> dict[str, Array]:
    """Arrays of a functional by their places."""
    flat, _ = jax.tree_util.tree_flatten_with_path(functional)
    return {jax.tree_util.keystr(path): leaf for path, leaf in flat if eqx.is_inexact_array(leaf)}


def _spanned(place: str, stack: Float[np.ndarray, " *scenes_and_leaf"]) -> Coefficient:
    """The coefficient of arrays that are different."""
    shape, dtype = stack.shape[1:], stack.dtype
    if not shape:
        return Coefficient((place,), jnp.zeros((), dtype), jnp.ones(1, dtype))
    flat = stack.reshape(len(stack), -1)
    left, sigma, right = np.linalg.svd(flat - flat[:1], full_matrices=False)
    count = int(np.count_nonzero(sigma > _ROUND_OFF * np.finfo(dtype).eps * np.abs(flat).max()))
    directions = right[:count]
    base = flat[0] - directions.T @ (directions @ flat[0])
    return Coefficient(
        (place,),
        jnp.asarray(base.reshape(shape), dtype),
        jnp.asarray(directions.reshape(count, *shape), dtype),
    )
