"""Functions of pairs as Triton knows them: it has no rounding to the nearest whole number."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jax.extend.core import Literal

_INLINED = {"jit": "jaxpr", "pjit": "jaxpr", "custom_jvp_call": "call_jaxpr"}  # what they call


def without_rounding(function: Callable) -> Callable:
    """The same function of arrays, returning a flat tuple, with floor(x + 1/2) for the nearest.

    They differ in halves alone: between periodic images equally far, where kernels are zero.
    """

    def call(*arguments):
        closed = jax.make_jaxpr(function)(*arguments)
        return tuple(_evaluated(closed, jax.tree.leaves(arguments)))

    return call


def _evaluated(closed, arguments) -> list:
    values = dict(zip(closed.jaxpr.constvars, closed.consts, strict=True))
    values |= zip(closed.jaxpr.invars, arguments, strict=True)

    def read(atom):
        return atom.val if isinstance(atom, Literal) else values[atom]

    for equation in closed.jaxpr.eqns:
        given, primitive = [read(atom) for atom in equation.invars], equation.primitive
        if primitive.name == "round":
            found = [jnp.floor(given[0] + 0.5)]
        elif primitive.name in _INLINED:
            found = _evaluated(equation.params[_INLINED[primitive.name]], given)
        else:
            found = primitive.bind(*given, **equation.params)
            found = found if primitive.multiple_results else [found]
        values |= zip(equation.outvars, found, strict=True)
    return [read(atom) for atom in closed.jaxpr.outvars]
