"""A scene's full model, run by the scene's own steps."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial

from .clumping import Clumping
from .kept_run import kept_run
from .progress import shown_steps
from .simulate import simulate
from .trajectory import Trajectory
from .wall_forces import WallForces, named


def run_scene(
    scene,
    path: str | os.PathLike | None = None,
    *,
    progress: bool | Callable[[int], None] | None = None,
    **options,
) -> Trajectory:
    """`simulate` the full model of a scene by the scene's own steps.

    Args:
        scene: to run.
        path: of a trajectory file that keeps the run, if any: it is made, gone on with where it was
            cut short, or read where it is whole. The scene may be any, edited ones too.
        progress: True for a bar on stderr, as of the command line; or what is called with the
            number of steps done since its last call.
        options: of `simulate`: `stepping`; `measure`, the forces on the scene's walls unless
            another is given, None for nothing; `averaged`, the same where parts of the walls are
            named, None for nothing; `watch`, `Clumping` unless another is given, None for none;
            and, without a path, `recorder`.

    Raises:
        TrajectoryFileError: if the file holds another run, naming what differs; it stays as it is.
        SimulationError: as `simulate`.

    Examples:
        >>> import jaxsph
        >>> from jaxsph.arrangements import Lattice
        >>> from jaxsph.metrics import kinetic_energy
        >>> scene = jaxsph.scenes.taylor_green(16, end_time=0.06, arrangement=Lattice())
        >>> trajectory = jaxsph.run_scene(scene)
        >>> energy = kinetic_energy(trajectory.velocity, float(scene.mass))
        >>> bool(energy[-1] < energy[0])  # viscosity takes it
        True
    """
    forces = WallForces.of(scene)
    options.setdefault("measure", forces)
    options.setdefault("averaged", named(forces))
    options.setdefault("watch", Clumping(scene.space))
    shown = partial(shown_steps, progress, scene.steps)
    if path is not None:
        return kept_run(
            path,
            scene,
            scene.model,
            lambda _: scene.state,
            lambda trajectory: trajectory.state(-1),
            shown,
            made_by={"stepping": options["stepping"]} if "stepping" in options else None,
            **options,
        )
    model = scene.model()
    with shown() as report:
        return simulate(
            model,
            scene.state,
            scene.schedule,
            progress=report,
            metadata={"scene": scene.name, "parameters": scene.parameters},
            **options,
        )
