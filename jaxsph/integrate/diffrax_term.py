"""Models of the time loop as terms of diffrax, for its adaptive and implicit solvers."""

from __future__ import annotations

from typing import Any

import diffrax

from .model import Model


def ode_term(model: Model, auxiliary: Any) -> diffrax.ODETerm:
    """dy/dt = rates(t, y) of a model, its auxiliary structure held as it is.

    For a model without auxiliary structure (`PointsModel`) this is the whole model. A neighbour
    list holds only while no particle has moved by more than half its skin from where it was made:
    integrate that far at most, ask `model.inspect(step, state, auxiliary)` at the end, and go on
    from `model.finish(state)` with a term made anew. Solvers try stages beyond their steps, and
    steps that they reject; a particle may outrun the list there unseen, so leave some of the skin.
    Where particles come in and go out through openings, go on from `model.end(state, auxiliary)`.

    Args:
        model: full or reduced.
        auxiliary: `model.prepare(state)` of the state that it starts from.

    Examples:
        >>> import diffrax
        >>> import jaxsph
        >>> from jaxsph.arrangements import Lattice
        >>> from jaxsph.integrate.diffrax_term import ode_term
        >>> scene = jaxsph.scenes.taylor_green(resolution=16, arrangement=Lattice())
        >>> model, state = scene.model(), scene.state
        >>> term = ode_term(model, model.prepare(state))
        >>> end = 2 * scene.time_step
        >>> solution = diffrax.diffeqsolve(term, diffrax.Heun(), 0.0, end, scene.time_step, state)
        >>> solution.ys.velocity.shape  # times, particles, directions
        (1, 256, 2)
    """
    return diffrax.ODETerm(lambda time, state, _: model.rates(time, state, auxiliary))
