"""The exact flow of a scene, and for which physics it is one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, final

from jaxtyping import Array, Float, ScalarLike

from ..content import digest

ExactFlow = Callable[
    [Float[Array, "points dim"], ScalarLike],
    tuple[Float[Array, "points dim"], Float[Array, " points"]],
]  # positions [m] and a time [s] -> velocity [m/s] and pressure [Pa]


@final
@dataclass(frozen=True)
class Solution:
    """An exact flow, bound to what a scene was when it was given one.

    Args:
        flow: positions (N, n) [m] and a time [s] -> velocity (N, n) [m/s] and pressure (N,) [Pa].
        physics: a hash of the scene's effects, fluid, box, walls and start.
    """

    flow: ExactFlow
    physics: str

    @classmethod
    def of(cls, scene: Any, flow: ExactFlow) -> Solution:
        """The flow as that of the scene as it is now."""
        return cls(flow, _physics(scene))

    def holds(self, scene: Any) -> bool:
        """Whether the scene's physics and start are still those that it was given for."""
        return _physics(scene) == self.physics


def _physics(scene: Any) -> str:
    return digest((scene.effects, scene.fluid, scene.space.box, scene.walls, scene.state))
