"""The dam break that meets a box: its start, its first moments beside the experiment, its judge."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from benchmarks.dam_break_3d import compared
from benchmarks.references.dam_break_3d import ARRIVAL, HEIGHT, TIME
from jaxsph import WallForces, run_scene
from jaxsph.metrics import surface_height
from jaxsph.scenes import dam_break_3d
from jaxsph.scenes.dam_break_3d import COLUMN, GAUGES, OBSTACLE, TANK


def test_it_starts_as_the_experiment_did():
    scene = dam_break_3d()
    place = np.asarray(scene.state.position)
    volume = float(scene.mass) * len(place) / 1000.0
    assert volume == pytest.approx(np.prod(COLUMN), rel=0.02)
    assert place[:, 0].min() > TANK[0] - COLUMN[0] and place[:, 2].max() < COLUMN[2]
    deepest = np.asarray(scene.fluid.pressure(scene.state.density)).max()
    assert deepest == pytest.approx(1000.0 * 9.81 * (COLUMN[2] - place[:, 2].min()), rel=1e-9)
    ghosts = np.asarray(scene.walls.position)[np.asarray(WallForces.of(scene).held[1])]
    assert len(ghosts) > 500
    assert (ghosts > np.asarray(OBSTACLE.lower) - 1e-9).all()
    assert (ghosts < np.asarray(OBSTACLE.upper) + 1e-9).all()


def test_a_box_of_too_few_particles_is_refused():
    with pytest.raises(ValueError, match="thinner than twice the kernel's support.*resolution"):
        dam_break_3d(90)


def test_the_judge_is_zero_on_the_experiment_itself():
    time = np.linspace(0.0, 4.0, 4001)
    heights = {name: np.interp(time, TIME, height) for name, height in HEIGHT.items()}
    found = compared(time, heights)
    assert all(found[f"{name}_off_percent"] < 1e-9 for name in GAUGES)
    for name, arrival in ARRIVAL.items():  # 0.1 s apart, so no nearer than half of that
        assert found[f"{name}_arrival"] == pytest.approx(arrival, abs=0.05)
    higher = compared(time, {"H4": heights["H4"] + 0.055})
    assert higher["H4_off_percent"] == pytest.approx(10.0)
    cut = compared(time[:1001], {"H1": heights["H1"][:1001]})
    assert cut["time"][-1] == 1.0


@pytest.mark.slow
def test_its_sides_are_mirror_images():
    """Judged early: round-off grows tenfold every 0.02 s once water shoots ahead, 2e-13 spacings
    at 0.06 s, 1e-11 at 0.1 s, 1e-10 at 0.12 s; at 0.3 s the water's height differs by 7e-5."""
    scene = dam_break_3d(end_time=0.1)
    start = np.asarray(scene.state.position)
    other = cKDTree(start).query(mirrored(start))[1]
    ghosts = np.asarray(scene.walls.position)
    assert cKDTree(ghosts).query(mirrored(ghosts))[0].max() < 1e-15
    run = run_scene(scene)
    apart = [np.abs(mirrored(place[other]) - place).max() for place in run.position]
    assert max(apart) < 1e-9 * scene.space.spacing


def mirrored(place):
    return place * [1.0, -1.0, 1.0] + [0.0, TANK[1], 0.0]


@pytest.mark.slow
def test_its_front_runs_as_the_experiments_did():
    """To the first gauge, and no water leaves."""
    scene = dam_break_3d(end_time=0.3)
    run = run_scene(scene)
    found = compared(
        run.time, {name: surface_height(run, scene, place) for name, place in GAUGES.items()}
    )
    # 0.26 s measured for 0.218, a snapshot every 0.02 s
    assert found["H3_arrival"] == pytest.approx(ARRIVAL["H3"], abs=0.05)
    assert found["H4_off_percent"] < 3.0  # 2.6 measured; the start is 1.7 percent too high
    last = run.position[-1]
    assert (last > 0.0).all() and (last < np.asarray(TANK)).all()
    np.testing.assert_allclose(run.mean_forces["box"], 0.0, atol=1e-9)  # not there yet
