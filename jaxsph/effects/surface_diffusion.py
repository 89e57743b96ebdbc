"""Density diffusion that stays consistent at the free surface."""

from .base import Effect


class SurfaceDiffusion(Effect):
    """Fades the renormalised density gradient out where too few neighbours carry it:

        <grad rho>_i <- c_i <grad rho>_i,

    c (`coherent`) zero for particles that fly alone or in thin jets. In the body of fluid, its
    surface included, the gradient keeps the diffusion of a hydrostatic column at zero (Antuono et
    al. 2010). Stands behind `DensityDiffusion` and `FreeSurface`, whose fields it needs.
    """

    def fields(self, context, fields, sums):
        return {"density_gradient": fields["coherent"][:, None] * fields["density_gradient"]}
