"""Whether a reduced run that came to its end is one to believe."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from jaxsph import Trajectory
from jaxsph.clumping import CLUMPED, nearest
from jaxsph.metrics import relative_discrepancy
from jaxsph.scenes import Scene

from .watch import OFF


def level_and_fluctuation(
    reference: Float[np.ndarray, "times places"], values: Float[np.ndarray, "times places"]
) -> tuple[Float[np.ndarray, " times"], Float[np.ndarray, " times"]]:
    """Percent relative discrepancy of the mean over the places, and that of what is left:

        100 |<c> - <c~>| / range(c),    100 <|(c - <c>) - (c~ - <c~>)|> / range(c).

    A fluid that fills its domain has a pressure up to a constant, so the second is what acts.

    Examples:
        >>> import numpy as np
        >>> from jaxsph_rom.study import level_and_fluctuation
        >>> pressure = np.array([[0.0, 1.0, 2.0]])
        >>> level, fluctuation = level_and_fluctuation(pressure, pressure + 0.5)
        >>> float(level[0]), float(fluctuation[0])
        (25.0, 0.0)
    """
    means = [a.mean(axis=1, keepdims=True) for a in (reference, values)]
    apart = np.abs(means[0] - means[1])[:, 0]
    spread = np.ptp(reference, axis=1)
    safe = np.where(spread > 0.0, spread, 1.0)
    level = np.where(apart == 0.0, 0.0, np.where(spread > 0.0, 100.0 * apart / safe, np.inf))
    return level, relative_discrepancy(reference - means[0], values - means[1])


def doubt(
    run: Trajectory,
    scene: Scene,
    time: Float[np.ndarray, " times"],
    pressure_percent: Float[np.ndarray, " times"],
) -> str | None:
    """Why a run is not to be believed, if it is not: the first of what is wrong in time.

    Args:
        run: of a reduced model.
        scene: whose particles it moves.
        time: that counts [s], the snapshots' or some of them.
        pressure_percent: discrepancy of the pressure's fluctuation then.
    """
    for k, now in enumerate(run.time):
        apart = nearest(run.position[k], scene.space.box) / scene.space.spacing
        if apart < CLUMPED:
            return f"particles clump from t = {now:.4g} s on: {apart:.2g} dx"
        at = np.flatnonzero(np.isclose(time, now))
        if len(at) and not pressure_percent[at[0]] <= OFF:
            return f"pressure is off by {pressure_percent[at[0]]:.0f} % at t = {now:.4g} s"
    return None
