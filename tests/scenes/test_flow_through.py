"""What cannot flow through is refused before it is run."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import BallRegion, BoxRegion
from jaxsph.effects import UniformProfile
from jaxsph.scenes import FringeEnds, OpenEnds, Scale, flow_through

BODY = BallRegion((2.0, 0.0), 0.5)
CHANNEL = BoxRegion((-np.inf, -1.5), (np.inf, 1.5))


def stream(region=~BODY, inflow=None, length=4.0, fringe=2.0, periodic=True, ends=None):
    return flow_through(
        "stream",
        length=length,
        ends=FringeEnds(fringe) if ends is None else ends,
        across=(-2.0, 2.0),
        periodic=periodic,
        region=region,
        side=1.0,
        speed=1.0,
        inflow=UniformProfile(1.0) if inflow is None else inflow,
        viscosity=0.05,
        scale=Scale(8, 1.5, 0.015, 10),
        mach=0.1,
        end_time=0.3,
    )


def test_a_body_before_the_fringe_and_straight_walls_are_taken():
    flowing = stream().state.velocity
    np.testing.assert_array_equal(flowing, np.broadcast_to([1.0, 0.0], flowing.shape))
    assert len(stream(CHANNEL & ~BODY, periodic=False).state.velocity) < len(flowing)
    # which widens in the first half of the fringe
    wider = BoxRegion((3.0, -2.0), (4.5, 2.0))
    stream(CHANNEL & ~BODY | wider, periodic=False)


@pytest.mark.parametrize(
    "settings, message",
    [
        ({"region": ~BallRegion((5.0, 0.0), 0.5)},
         "region: its walls change at x = 5.* along the fringe, 4 m to 6 m"),
        ({"region": CHANNEL & ~BODY | BoxRegion((4.5, -2.0), (5.5, 0.0)), "periodic": False},
         r"at x = 5\.\d+ m, along the fringe"),
        ({"region": ~BallRegion((4.5, 0.0), 0.5), "ends": OpenEnds()},
         "region: its walls change at x = 4.* along the outlet's buffer, 4 m to"),
        ({"inflow": lambda x, t: x[:, 0]}, r"inflow: gives an array of shape \(\d+,\)"),
        ({"inflow": UniformProfile(20.0)}, "inflow: is as fast as 20 m/s at the start"),
        ({"inflow": UniformProfile(jnp.nan)}, "inflow: is as fast as nan m/s"),
        ({"fringe": 0.0}, "fringe: its end 4 m must lie behind"),
        ({"length": -4.0}, "Box: every upper must exceed its lower"),
    ],
)  # fmt: skip
def test_bad_flows_are_refused(settings, message):
    with pytest.raises(ValueError, match=message):
        stream(**settings)
