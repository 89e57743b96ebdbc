"""What every smoothing kernel offers."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from jaxtyping import Array, Float


@dataclass(frozen=True)
class Kernel(ABC):
    """A radial smoothing kernel W(r, h) = a_n / h^n w(r / h), zero for r >= support * h.

    A kernel is structure, not data: it has no array leaves, is hashed and compared by value, and
    belongs in a static field.

    Attributes:
        support: support radius over smoothing length.
        normalisation: a_n for each dimension n it is defined in, such that W integrates to one.
    """

    support: ClassVar[float]
    normalisation: ClassVar[Mapping[int, float]]

    @abstractmethod
    def value(self, r: Float[Array, "*pairs"], h: float, dim: int) -> Float[Array, "*pairs"]:
        """W(r, h) [1/m^dim].

        Args:
            r: distances [m], at least zero.
            h: smoothing length [m].
            dim: dimension of space.
        """

    @abstractmethod
    def gradient_over_r(
        self, r: Float[Array, "*pairs"], h: float, dim: int
    ) -> Float[Array, "*pairs"]:
        """(dW/dr) / r [1/m^(dim + 2)], finite at r = 0: grad W = gradient_over_r (x_i - x_j).

        Args:
            r, h, dim: as for `value`.
        """

    def scale(self, h: float, dim: int) -> float:
        """a_n / h^n [1/m^dim].

        Raises:
            ValueError: where the kernel has no such dimension.
        """
        if dim not in self.normalisation:
            raise ValueError(
                f"dim: {type(self).__name__} is defined in dimensions "
                f"{sorted(self.normalisation)}, got {dim!r}; pass one of these."
            )
        return self.normalisation[dim] / h**dim
