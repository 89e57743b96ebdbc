"""A tank that fills: as much as comes in stands in it."""

import importlib

import numpy as np
import pytest
from scipy.integrate import quad

from jaxsph import run_scene
from jaxsph.ramps import ramp
from jaxsph.scenes import filling_tank

filling = importlib.import_module("jaxsph.scenes.filling_tank")


def test_the_level_is_that_of_what_has_come_in():
    scene = filling_tank(20, end_time=1.6)
    flow = run_scene(scene)
    exact = filling.level(flow.time, 0.25)
    inside = flow.active & (flow.position[:, :, 0] > 0.0)
    volume = inside.sum(axis=1) * scene.space.cell_volume
    column = 4 * scene.space.cell_volume  # comes in at about one time
    np.testing.assert_allclose(volume, exact, atol=column)
    top = np.where(inside, flow.position[:, :, 1], 0.0).max(axis=1) + 0.5 * scene.space.spacing
    np.testing.assert_allclose(top, exact, atol=1.5 * scene.space.spacing)
    assert (np.diff(flow.active.sum(axis=1)) >= 0).all() and flow.active[-1].sum() > 230
    assert np.linalg.norm(flow.velocity, axis=2).max() < 0.5


def test_level_is_the_integral_of_the_inflow():
    for time in (0.2, 0.5, 1.3):
        total = quad(lambda t: float(ramp(t, 0.0, filling.OPENS)), 0.0, time, points=[0.5])[0]
        assert filling.level(np.asarray(time), 0.3) == pytest.approx(0.4 + 0.06 * total, rel=1e-6)


def test_a_tank_that_would_overflow_is_refused():
    with pytest.raises(ValueError, match="t-end: by 20 s the water stands 1.39 m high"):
        filling_tank(40, end_time=20.0)
    with pytest.raises(ValueError, match="inflow: must be positive"):
        filling_tank(40, inflow=-0.1)
