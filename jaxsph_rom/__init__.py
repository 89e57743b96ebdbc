"""Projection-based reduced models of smoothed-particle hydrodynamics."""
