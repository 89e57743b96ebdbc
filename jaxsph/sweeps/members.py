"""Members of a sweep as one pytree with a leading axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

import equinox as eqx
import jax
import numpy as np

from ..full_model import FullModel
from ..neighbors import NeighborSearch, WalledSearch
from ..particles import ParticleState
from ..scenes import Scene
from ..wall_forces import WallForces
from ..walls.turning import alike

_SAME = ("name", "space", "schedule")
_REFERENCES = ("reference_lengths", "reference_speeds", "density")


class Members(eqx.Module):
    """Full models, their states and the forces on their walls, stacked: every array has a leading
    axis of members.

    Args:
        arrays: of all members, (K, ...), on the host.
        structure: what they share: effects, kernel, capacities.
    """

    arrays: Any
    structure: Any = eqx.field(static=True)

    def select(self, numbers: Sequence[int]) -> Any:
        """The arrays of some members."""
        return jax.tree.map(lambda a: a[np.asarray(numbers)], self.arrays)

    def one(self, arrays: Any) -> tuple[FullModel, ParticleState, WallForces | None]:
        """Model, state and forces of a member from its arrays, within jit."""
        return eqx.combine(arrays, self.structure)

    def enlarged(self) -> Members:
        """The same members with more room for neighbours."""
        model, *rest = self.structure
        return Members(self.arrays, (model.enlarged(), *rest))


def stacked(scenes: Sequence[Scene]) -> Members:
    """The full models of scenes that differ in what is in their arrays alone.

    Raises:
        ValueError: if there is none, or if they differ in more.
    """
    if not scenes:
        raise ValueError("scenes: a sweep needs at least one.")
    for name in _SAME:
        for k, scene in enumerate(scenes):
            if getattr(scene, name) != getattr(scenes[0], name):
                raise ValueError(
                    f"scenes: number {k} differs from the first in {name.replace('_', ' ')}; a "
                    "sweep is over coefficients and starts: make all with the same size and steps."
                )
    models = [scene.model() for scene in scenes]
    search = _roomiest([model.search for model in models])
    forces = _alike([WallForces.of(scene) for scene in scenes])
    members = [
        eqx.partition((replace(model, search=search), scene.state, on_walls), eqx.is_array)
        for model, scene, on_walls in zip(models, scenes, forces, strict=True)
    ]
    first, structure = members[0]
    same = jax.tree.leaves(structure)  # functions that move bodies, say
    for k, (arrays, static) in enumerate(members):
        alike = jax.tree.structure((arrays, static)) == jax.tree.structure((first, structure))
        if (
            not alike
            or jax.tree.leaves(static) != same
            or any(
                a.shape != b.shape or a.dtype != b.dtype
                for a, b in zip(jax.tree.leaves(arrays), jax.tree.leaves(first), strict=True)
            )
        ):
            raise ValueError(
                f"scenes: number {k} has other effects, walls or particles than the first; make "
                "all with the same ones."
            )
    arrays = jax.tree.map(lambda *a: np.stack([np.asarray(x) for x in a]), *[m for m, _ in members])
    return Members(arrays, structure)


def _alike(forces: Sequence[WallForces | None]) -> list[WallForces | None]:
    """The same, all with the references of the first, for what coefficients refer to is in no sum,
    and with room for as many parts that turn."""
    first = forces[0]
    if first is None:
        return list(forces)
    same = {name: getattr(first, name) for name in _REFERENCES}
    turnings = alike([each and each.turning for each in forces])
    return [
        each and replace(each, turning=turning, **same)
        for each, turning in zip(forces, turnings, strict=True)
    ]


def _roomiest(searches: Sequence[NeighborSearch | WalledSearch]) -> NeighborSearch | WalledSearch:
    """A search with the largest capacities of all."""
    first = searches[0]
    found = {}
    for field in fields(first):
        values = [getattr(search, field.name) for search in searches]
        if isinstance(values[0], int):
            found[field.name] = max(values)
        elif isinstance(values[0], NeighborSearch):
            found[field.name] = _roomiest(values)
    return replace(first, **found)
