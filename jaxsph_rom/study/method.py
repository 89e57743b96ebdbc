"""How models on moving particles are made of full runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, final

from jaxsph.interpolation import KernelMap, QuadraticMap, ShepardMap

from ..basis import Centring, Energy, Euclidean, InnerProduct
from ..field_advection import Advection, ModeAdvection, PaperAdvection
from ..mode_interpolation import ModeInterpolation
from ..splines import LocalSplines


@final
@dataclass(frozen=True)
class Method:
    """Choices of a model on moving particles; what measures best unless told otherwise.

    Args:
        product: inner product of the POD and the projection.
        advection: how the Eulerian functional is made.
        rule: of the map to the reference points.
        interpolation: of the modes, from the reference points back to particles; besides
            `LocalSplines` there is `LatticePolynomials`, where particles start on a lattice.
        spline_order: of the interpolation's splines or polynomials.
        centring: of the POD; the product's own if none is given.
    """

    product: InnerProduct = Energy()  # noqa: RUF009
    advection: Advection = ModeAdvection()  # noqa: RUF009
    rule: type[KernelMap] = QuadraticMap
    interpolation: type[ModeInterpolation] = LocalSplines
    spline_order: int = 3
    centring: Centring | None = None

    @property
    def product_name(self) -> str:
        """The inner product, and the centring if it is not the product's own."""
        product, own = type(self.product).__name__, type(self.product.centring)
        same = self.centring is None or isinstance(self.centring, own)
        return product if same else f"{product}-{type(self.centring).__name__}"

    @property
    def label(self) -> str:
        """A name for folders: what differs from the paper's, and the product."""
        parts = [self.product_name.lower()]
        if self.advection != FAITHFUL.advection:
            parts.append(self.advection.name)
        if self.rule is not FAITHFUL.rule:
            parts.append(self.rule.__name__.removesuffix("Map").lower())
        if self.interpolation is not FAITHFUL.interpolation:
            parts.append(self.interpolation.__name__.lower())
        if self.spline_order != FAITHFUL.spline_order:
            parts.append(f"order-{self.spline_order}")
        return "-".join(parts)

    def record(self) -> dict[str, Any]:
        """The choices in words."""
        return {
            "inner_product": self.product_name,
            "advection": self.advection.name,
            "spline_order": self.spline_order,
            "map": self.rule.__name__,
            "interpolation": self.interpolation.__name__,
        }


FAITHFUL = Method(Euclidean(), PaperAdvection(), ShepardMap)  # the source paper's, as printed
