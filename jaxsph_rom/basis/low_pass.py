"""Snapshots without the fast part of their sound."""

from __future__ import annotations

import numpy as np
import scipy.signal
from jaxtyping import Float

_UNEVEN = 1e-6  # of an interval


def least_snapshots(order: int = 4) -> int:
    """As many as the filter needs: what scipy continues the signal by, and one."""
    return 3 * (order + 1) + 1


def low_pass(
    snapshots: Float[np.ndarray, "points fields times"],
    time: Float[np.ndarray, " times"],
    cutoff: float,
    order: int = 4,
) -> Float[np.ndarray, "points fields times"]:
    """Zero-phase low-pass in time: a Butterworth filter of gain

        |H(f)|^2 = 1 / (1 + (f / f_c)^(2 order)),

    run forwards and backwards over each number of the state (Gustafsson 1996), so that the
    amplitude is |H|^2, a half at the cutoff, and nothing is delayed. At both ends the signal is
    continued by its point reflection, which keeps a trend but not the phase of a wave.

    The slowest sound in a box of longest side L has the frequency c0 / (2 L) between walls and
    c0 / L in a periodic box: a cutoff of c0 / (2 L) damps sound and keeps a flow of speed U, whose
    own frequency U / L is lower by half the Mach number, Ma = U / c0.

    Args:
        snapshots: (G, F, S) of one run; filter several one by one.
        time: of the snapshots [s], evenly spaced.
        cutoff: f_c [Hz].
        order: of the filter in one direction.

    Raises:
        ValueError: if times are not even, snapshots are too few for the filter, or the cutoff is
            not between 0 and the Nyquist frequency.
    """
    time = np.asarray(time, float)
    if order < 1:
        raise ValueError(f"order: a filter needs at least 1, got {order}.")
    needed = least_snapshots(order)
    if len(time) < needed:
        raise ValueError(
            f"snapshots: {len(time)}, but a filter of order {order} needs {needed}; record more "
            "often, or lower the order."
        )
    if len(time) != snapshots.shape[2]:
        raise ValueError(
            f"time: {len(time)} values for {snapshots.shape[2]} snapshots; give one for each."
        )
    interval = (time[-1] - time[0]) / (len(time) - 1)
    if not (interval > 0.0 and np.abs(np.diff(time) - interval).max() <= _UNEVEN * interval):
        raise ValueError(
            "time: not evenly spaced, as a filter needs it; filter runs one by one, and leave out "
            "what was recorded at another interval."
        )
    nyquist = 0.5 / interval
    if not 0.0 < cutoff < nyquist:
        raise ValueError(
            f"cutoff: {cutoff:g} Hz, but snapshots every {interval:g} s hold frequencies between 0 "
            f"and {nyquist:g} Hz; choose one of these or record more often."
        )
    sections = scipy.signal.butter(order, cutoff, fs=1.0 / interval, output="sos")
    continued = needed - 1
    return scipy.signal.sosfiltfilt(sections, snapshots, axis=2, padlen=continued).astype(
        snapshots.dtype, copy=False
    )
