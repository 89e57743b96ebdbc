"""Thresholds and roots that have a derivative everywhere."""

import jax.numpy as jnp

_ROUND_OFF = 1e-12


def root(square):
    """The square root, without a slope at zero."""
    positive = square > _ROUND_OFF
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, square, 1.0)), 0.0)


def ramp(value, low, high):
    """0 below `low`, 1 above `high`, with a smooth rise between (cubic)."""
    share = jnp.clip((value - low) / (high - low), 0.0, 1.0)
    return share * share * (3.0 - 2.0 * share)
