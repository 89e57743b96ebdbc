"""Peers side by side: this full model, PySPH and JAX-SPH on the same particles."""
