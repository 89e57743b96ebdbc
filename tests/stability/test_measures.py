"""The judge is judged: figures of known trajectories, and promises broken on purpose."""

import dataclasses
import math

import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks.hard_cases import measures
from benchmarks.hard_cases.bounds import DENSITY, DISTANCE, LOOSE_DENSITY, WALLS
from benchmarks.hard_cases.full_cases import every
from benchmarks.hard_cases.judge import Case, Ending, Outcome, Run, all_finite, complaints, run_case
from jaxsph import Trajectory
from jaxsph.arrangements import Lattice
from jaxsph.integrate import FaultCode
from jaxsph.scenes import lid_driven_cavity, taylor_green


@pytest.fixture(scope="module")
def scene():
    return taylor_green(10, h_over_dx=1.2, end_time=0.1, arrangement=Lattice())


def trajectory(scene, position=None, velocity=None, density=None):
    """Two snapshots: the scene's start, and the same with something else in it."""
    s = scene.state
    later = [s.position if position is None else position,
             s.velocity if velocity is None else velocity,
             s.density if density is None else density]  # fmt: skip
    first = (s.position, s.velocity, s.density)
    both = [np.stack([a, b]) for a, b in zip(first, later, strict=True)]
    return Trajectory(np.array([0.0, 0.1]), *both, np.zeros_like(both[2]))


def test_a_lattice_is_even(scene):
    run = trajectory(scene, position=scene.state.position + 0.37)  # beyond the box: periodic
    assert measures.least_distance(scene, run) == pytest.approx(1.0, abs=1e-12)
    assert measures.unevenness(scene, run) == pytest.approx(0.0, abs=1e-12)
    assert measures.volume_spread(scene, run) == pytest.approx(0.0, abs=1e-12)


def test_one_particle_moved(scene):
    """It is 0.75 dx from its neighbour then, which is that of two; the kernel sums are uneven."""
    moved = scene.state.position.at[55, 0].add(0.25 * scene.space.spacing)
    run = trajectory(scene, position=moved)
    assert measures.least_distance(scene, run) == pytest.approx(0.75, abs=1e-12)
    nearest = np.ones(100)
    nearest[:2] = 0.75
    assert measures.unevenness(scene, run) == pytest.approx(nearest.std(), abs=1e-12)
    space, x = scene.space, np.asarray(moved)
    d = x[None] - x[:, None]
    d -= np.round(d)
    r = jnp.asarray(np.linalg.norm(d, axis=-1))
    sums = np.asarray(space.kernel.value(r, space.smoothing_length, 2)).sum(1) * space.spacing**2
    assert measures.volume_spread(scene, run) == pytest.approx(sums.std(), rel=1e-12)


def test_particles_at_one_place_are_seen(scene):
    run = trajectory(scene, position=scene.state.position.at[1].set(scene.state.position[0]))
    assert measures.least_distance(scene, run) == 0.0


def test_energy_momentum_and_density(scene):
    velocity, density = scene.state.velocity, scene.state.density
    run = trajectory(scene, velocity=2.0 * velocity + 0.03, density=1.1 * density)
    squared = float((velocity**2).sum())
    grown = float(((2.0 * velocity + 0.03) ** 2).sum()) / squared
    assert measures.energy_over_start(scene, run) == pytest.approx(grown, rel=1e-12)
    assert measures.energy_change(scene, run) == pytest.approx(grown - 1.0, rel=1e-12)
    share = grown * squared / 100
    assert measures.energy_over_reference(scene, run) == pytest.approx(share, rel=1e-12)
    # the mean of the vortices themselves is zero
    drift = 0.03 * math.sqrt(2.0)
    assert measures.momentum_drift(scene, run) == pytest.approx(drift, rel=1e-9)
    high = 1.1 * float(density.max()) / 1000.0 - 1.0
    assert measures.density_deviation(scene, run) == pytest.approx(high, rel=1e-12)
    fastest = float(jnp.linalg.norm(2.0 * velocity + 0.03, axis=1).max())
    assert measures.highest_speed(scene, run) == pytest.approx(fastest, rel=1e-12)


def test_a_particle_beyond_a_wall_is_counted():
    scene = lid_driven_cavity(10, end_time=0.1)
    assert measures.beyond_walls(scene, trajectory(scene)) == 0.0
    beyond = trajectory(scene, position=scene.state.position.at[3, 1].set(-1e-6))
    assert measures.beyond_walls(scene, beyond) == 1.0


def test_bounds():
    assert DENSITY.kept(0.03) and not DENSITY.kept(0.0301) and not DENSITY.kept(math.nan)
    assert DISTANCE.kept(0.2) and not DISTANCE.kept(0.19) and not DISTANCE.kept(math.nan)
    assert DENSITY.used(0.015) == 0.5 and DISTANCE.used(0.4) == 0.5
    assert DISTANCE.used(0.0) == math.inf and WALLS.used(0.0) == 0.0 and WALLS.used(1.0) > 1.0


def test_what_is_not_finite_is_seen(scene):
    assert all_finite(trajectory(scene))
    for value in (np.nan, np.inf):
        assert not all_finite(trajectory(scene, density=scene.state.density.at[7].set(value)))


def test_complaints(scene):
    case = Case("a/b", "", lambda: None, (DENSITY,), says="clear", codes=(FaultCode.NOT_FINITE,))
    good = Outcome(Ending.FINISHED, values={"density": 0.01})
    assert complaints(case, good) == []
    assert complaints(case, dataclasses.replace(good, finite=False)) == [
        "a number that is not finite was recorded"
    ]
    assert "density: 0.05, wanted <= 0.03" in complaints(
        case, dataclasses.replace(good, values={"density": 0.05})
    )
    refused = Outcome(Ending.REFUSED, "clear words")
    assert complaints(case, refused) == ["it ended as refused (clear words)"]
    case = dataclasses.replace(case, endings=(Ending.REFUSED, Ending.FAULT))
    assert complaints(case, refused) == []
    assert complaints(case, Outcome(Ending.REFUSED, "what"))
    fault = Outcome(Ending.FAULT, "clear words", FaultCode.NOT_FINITE)
    assert complaints(case, fault) == []
    assert complaints(case, dataclasses.replace(fault, code=FaultCode.BEYOND_WALL))


def test_a_case_ends_as_it_does(scene):
    """Its bounds are measured; a ValueError is a refusal, another error is never good."""
    run = run_case(Case("a/b", "", lambda: Run(scene, every(scene, 3)), (LOOSE_DENSITY,)))
    assert run.ending is Ending.FINISHED and run.finite and run.steps % 3 == 0
    assert run.recorded == run.steps // 3 + 1
    assert LOOSE_DENSITY.kept(run.values["density"])

    def refuse():
        raise ValueError("clear words")

    def break_down():
        return 1 // 0

    assert run_case(Case("a/b", "", refuse)).says == "clear words"
    broken = Case("a/b", "", break_down, endings=(Ending.FINISHED, Ending.REFUSED, Ending.FAULT))
    outcome = run_case(broken)
    assert outcome.ending is Ending.BROKEN and "ZeroDivisionError" in outcome.says
    assert complaints(broken, outcome)
