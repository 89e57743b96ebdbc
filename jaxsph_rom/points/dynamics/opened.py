"""Which coefficients operators leave open, and how they depend on them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .reference_operators import ReferenceOperators

_SAME = 1e-6  # of what a coefficient does
_ROUND_OFF = 1e3  # times the precision, of all that acts
_SEED = 0


class Opened(eqx.Module):
    """How operators depend on their coefficients.

    Args:
        middle: theta about which operators are taken.
        powers: of theta in each monomial but the constant (static).
    """

    middle: Float[Array, " coefficients"]
    powers: tuple[tuple[int, ...], ...] = eqx.field(static=True)

    @classmethod
    def found(
        cls, operators: ReferenceOperators, values: Sequence[Float[Array, " coefficients"]]
    ) -> Opened:
        """The monomials, up to the second power, that the operators are made of.

        At a random state their differences over the training range are taken, and what follows
        from these is compared with the operators half as far outside.

        Raises:
            ValueError: if they depend on a coefficient otherwise.
        """
        stack = np.stack(values)
        low, high = stack.min(axis=0), stack.max(axis=0)
        middle, reach = 0.5 * (low + high), 0.5 * (high - low)
        size = len(middle)
        units = [tuple(int(k == i) for i in range(size)) for k in range(size)]
        draw = np.random.default_rng(_SEED).uniform(-1.0, 1.0, operators.rest.shape)
        scale = np.ones(draw.shape[1])
        fluid = operators.functional.fluid
        ratio = float(fluid.reference_speed) / float(fluid.sound_speed)
        scale[0] = ratio**2 * float(fluid.reference_density)
        scale[1:] = float(fluid.reference_speed)
        dtype = operators.points.dtype
        direction = jnp.asarray(draw * scale, dtype)

        def at(**steps):
            offset = np.zeros(size)
            for name, step in steps.items():
                offset[int(name[1:])] = step * reach[int(name[1:])]
            found = operators.along(direction, jnp.asarray(middle + offset, dtype))
            rates, gradients, *along = (np.asarray(part, float) for part in found)
            return [rates + along[0], gradients + along[1]]

        zero = at()
        moved = [(at(**{f"k{k}": 1.0}), at(**{f"k{k}": -1.0})) for k in range(size)]
        powers = list(units)
        for part in range(len(zero)):
            largest = _ROUND_OFF * np.finfo(dtype).eps * np.abs(zero[part]).max()
            slope = [0.5 * (p[part] - m[part]) for p, m in moved]
            bend = [p[part] + m[part] - 2.0 * zero[part] for p, m in moved]
            allowed = [_SAME * np.abs(s).max() + largest for s in slope]
            for k in range(size):
                twice = tuple(2 * u for u in units[k])
                if np.abs(bend[k]).max() > allowed[k] and twice not in powers:
                    powers.append(twice)
                outside = at(**{f"k{k}": 1.5})[part]
                followed = zero[part] + 1.5 * slope[k] + 0.5 * 1.5**2 * bend[k]
                if np.abs(outside - followed).max() > 10.0 * allowed[k]:
                    raise ValueError(
                        f"make: the operators are no polynomial of second degree in "
                        f"{operators.coefficients.names[k]}, and constant tensors hold no more; "
                        "use reduction=Samples() for this family."
                    )
            for k, i in combinations(range(size), 2):
                both = at(**{f"k{k}": 1.0, f"k{i}": 1.0})[part]
                mixed = both - moved[k][0][part] - moved[i][0][part] + zero[part]
                power = tuple(a + b for a, b in zip(units[k], units[i], strict=True))
                if np.abs(mixed).max() > allowed[k] + allowed[i] and power not in powers:
                    powers.append(power)
        return cls(jnp.asarray(middle, dtype), tuple(powers))
