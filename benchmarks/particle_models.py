"""What benchmarks of models on moving particles vary, by name."""

from jaxsph_rom import AdjointPetrovGalerkin, Galerkin, LatticePolynomials, LocalSplines

INTERPOLATIONS = {"splines": LocalSplines, "polynomials": LatticePolynomials}
PROJECTIONS = {"galerkin": Galerkin(), "apg": AdjointPetrovGalerkin(1e-4)}
