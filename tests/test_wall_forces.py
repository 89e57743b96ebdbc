"""Forces on walls: action equals reaction, water's weight, buoyancy, derivatives, files."""

import dataclasses
import json

import equinox as eqx
import h5py
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxsph
from jaxsph import BallRegion, Box, BoxRegion, WallForces, WallPart
from jaxsph.cli import main
from jaxsph.effects import Gravity
from jaxsph.integrate import integrate
from jaxsph.io import read_forces, read_overview, read_trajectory, snapshot_blocks
from jaxsph.plotting import forces_figure
from jaxsph.report.run_report import write_run_report
from jaxsph.scenes import Scale, couette, enclosed_flow, sloshing, taylor_green
from jaxsph.schemes import Consistent, DeltaPlus
from jaxsph.wall_forces import loads
from jaxsph.wall_surface import moment
from tests.pages import checked_page

START = jnp.zeros(())
GRAVITY = 1.0  # m/s^2
# effects whose sums over the fluid alone give it no momentum; others leave a residue of their own
CONSERVING = {
    "KernelCorrection", "AdjointPressure", "PairRepulsion", "Continuity", "PressureForce",
    "LaminarViscosity", "DensityDiffusion", "WallPressure", "NoSlip", "LocalNoSlip",
    "WallRepulsion", "Gravity",
}  # fmt: skip


def vessel(scheme, dim=2, resolution=16, gravity=GRAVITY):
    """A ball that is held in a tank full of water."""
    ball = BallRegion((0.5,) * dim, 0.2 if dim == 2 else 0.25)
    bottom = BoxRegion((-np.inf,) * dim, (*(np.inf,) * (dim - 1), 0.0))
    down = jnp.zeros(dim).at[-1].set(-gravity)
    return enclosed_flow(
        "vessel",
        box=Box((0.0,) * dim, (1.0,) * dim, (False,) * dim),
        fluid_region=BoxRegion((0.0,) * dim, (1.0,) * dim) & ~ball,
        scale=Scale(resolution, 1.25, 1e-3, 2),
        end_time=0.01,
        reference_density=1000.0,
        reference_speed=1.0,
        viscosity=0.01,
        scheme=scheme,
        force=Gravity(down) if gravity else None,
        parts=[WallPart("ball", ball, 0.4, 0.5), WallPart("bottom", bottom)],
    )


def conserving(scene):
    """The scene with what conserves momentum alone."""
    kept = tuple(effect for effect in scene.effects if effect.name in CONSERVING)
    return dataclasses.replace(scene, effects=kept)


def at_rest(scene, level=0.5):
    """Its water in equilibrium."""
    height = scene.state.position[:, -1]
    density = scene.fluid.density_of_enthalpy(GRAVITY * (level - height))
    return dataclasses.replace(scene.state, density=density)


def stirred(scene):
    """Its water in disorder, pressed together here and there, some of it close to a wall."""
    keys, state, dx = jax.random.split(jax.random.key(1), 3), scene.state, scene.space.spacing
    position = state.position + 0.3 * dx * jax.random.uniform(
        keys[0], state.position.shape, minval=-1.0
    )
    return jaxsph.ParticleState(
        scene.walls.put_inside(position, 0.1 * dx),
        0.1 * jax.random.normal(keys[1], state.position.shape),
        state.density * (1.0 + 1e-3 * jax.random.normal(keys[2], state.density.shape)),
    )


@pytest.mark.parametrize(
    "scheme, dim",
    [
        pytest.param(Consistent(), 2, id="consistent-2"),
        pytest.param(Consistent(), 3, id="consistent-3", marks=pytest.mark.slow),
        pytest.param(DeltaPlus(), 2, id="delta-plus-2"),
        pytest.param(DeltaPlus(), 3, id="delta-plus-3"),
    ],
)
@pytest.mark.run_once
def test_walls_get_what_the_fluid_loses(scheme, dim):
    """Force on all walls, weight and rate of momentum, for what conserves momentum in the fluid;
    and their moments, where all pairs of the fluid pull along the line between them."""
    scene = conserving(vessel(scheme, dim, 16 if dim == 2 else 12))
    state, model, measure = stirred(scene), scene.model(), WallForces.of(scene)
    forces, torques = measure(model, START, state)
    rates = eqx.filter_jit(model.rates)(START, state, model.prepare(state))
    momentum = scene.mass * np.asarray(rates.velocity).sum(axis=0)
    weight = np.zeros(dim)
    weight[-1] = -GRAVITY * scene.mass * len(state.position)
    largest = np.abs(forces["walls"]).max()
    # the terms' own size, and some thousand of them are added
    np.testing.assert_allclose(forces["walls"] - weight + momentum, 0.0, atol=1e-10 * largest)
    assert np.abs(forces["ball"]).max() > 0.01 * largest, "a force that is there"
    if isinstance(scheme, DeltaPlus):
        down = np.zeros_like(state.position)
        down[:, -1] = -GRAVITY
        gained = np.stack(moment(state.position.T, (scene.mass * (down - rates.velocity)).T))
        lever = np.squeeze(gained.sum(axis=1))
        largest = np.abs(torques["walls"]).max()
        np.testing.assert_allclose(torques["walls"], lever, atol=1e-10 * largest)
    assert set(forces) == set(torques) == {"walls", "ball", "bottom"}
    assert torques["ball"].shape == (() if dim == 2 else (3,))


@pytest.mark.run_once
def test_parts_add_up_to_the_whole():
    scene = vessel(Consistent())
    rest = WallPart("rest", ~BallRegion((0.5, 0.5), 0.2) & BoxRegion((-1.0, 0.0), (2.0, 2.0)))
    walls = dataclasses.replace(scene.walls, parts=(*scene.walls.parts, rest))
    scene = dataclasses.replace(scene, walls=walls)
    forces, torques = WallForces.of(scene)(scene.model(), START, stirred(scene))
    for each in (forces, torques):
        total = each["ball"] + each["bottom"] + each["rest"]
        np.testing.assert_allclose(total, each["walls"], rtol=1e-10, atol=1e-8)


@pytest.mark.run_once
def test_tank_at_rest_weighs_what_its_water_weighs():
    scene = vessel(Consistent(), resolution=20)
    forces, torques = WallForces.of(scene)(scene.model(), START, at_rest(scene))
    weight = GRAVITY * float(scene.mass) * len(scene.state.position)
    np.testing.assert_allclose(forces["walls"], [0.0, -weight], rtol=1e-3, atol=1e-6 * weight)
    # buoyancy: the water that the disc takes the place of; cells cut by it count in second order
    np.testing.assert_allclose(forces["ball"], [0.0, 1000.0 * np.pi * 0.2**2], rtol=0.02, atol=1e-8)
    # pressure at the bottom times its metre: it starts at p = 0 half-way up
    np.testing.assert_allclose(forces["bottom"], [0.0, -500.0], rtol=0.01, atol=1e-8)
    # each acts in its own middle
    np.testing.assert_allclose(torques["walls"], 0.5 * forces["walls"][1], rtol=1e-3)
    np.testing.assert_allclose(torques["ball"], 0.5 * forces["ball"][1], rtol=1e-3)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.run_once
def test_body_in_uniform_pressure_feels_none(dim):
    scene = vessel(Consistent(), dim, 16 if dim == 2 else 12, gravity=0.0)
    density = jnp.full_like(scene.state.density, 1010.0)
    state = dataclasses.replace(scene.state, density=density)
    forces, torques = WallForces.of(scene)(scene.model(), START, state)
    pressure = float(scene.fluid.pressure(density[0]))
    for name in ("ball", "walls"):
        np.testing.assert_allclose(forces[name], 0.0, atol=1e-12 * pressure)
        np.testing.assert_allclose(torques[name], 0.0, atol=1e-12 * pressure)
    assert forces["bottom"][-1] == pytest.approx(-pressure, rel=1e-12)


@pytest.mark.run_once
def test_shear_drags_the_plates():
    """A linear profile: -mu U / H on the plate at rest, its opposite on the other."""
    scene = couette(16, arrangement=jaxsph.arrangements.Lattice())
    plates = (
        WallPart("below", BoxRegion((-np.inf, -np.inf), (np.inf, 0.0))),
        WallPart("above", BoxRegion((-np.inf, 1.0), (np.inf, np.inf))),
    )
    walls = dataclasses.replace(scene.walls, parts=plates)
    scene = dataclasses.replace(scene, walls=walls)
    height = scene.state.position[:, 1]
    state = dataclasses.replace(scene.state, velocity=jnp.stack([height, 0.0 * height], axis=1))
    forces, _ = WallForces.of(scene)(scene.model(), START, state)
    length = scene.space.box.lengths[0]
    shear = float(scene.effects[2].viscosity) * length  # rho0 = U = H = 1
    # exact on a lattice, whose trace normalises the sum; in disorder single moments scatter
    np.testing.assert_allclose(forces["below"], [shear, 0.0], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(forces["above"], [-shear, 0.0], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("scheme", [Consistent(), DeltaPlus()], ids=["consistent", "delta-plus"])
@pytest.mark.run_once
def test_forces_are_differentiable(scheme):
    scene = conserving(vessel(scheme))
    state, model, measure = stirred(scene), scene.model(), WallForces.of(scene)
    way = jax.tree.map(lambda a: 1e-3 * jax.random.normal(jax.random.key(3), a.shape), state)

    @jax.jit
    def drag(step):
        moved = jax.tree.map(lambda a, d: a + step * d, state, way)
        return loads(measure, model, START, moved).force[1, 0]

    slope = float(jax.jvp(drag, (START,), (jnp.ones(()),))[1])
    step = 1e-4
    difference = float((drag(step) - drag(-step)) / (2.0 * step))
    assert slope == pytest.approx(difference, rel=1e-5)  # second order and round-off of the step
    if isinstance(scheme, DeltaPlus):  # the same sums turned round; fewer of them to compile
        assert float(jax.grad(drag)(START)) == pytest.approx(slope, rel=1e-9)


@pytest.mark.run_once
def test_a_list_without_room_is_made_anew_or_the_force_is_none():
    scene = vessel(DeltaPlus())
    state, model, measure = stirred(scene), scene.model(margin=2.0), WallForces.of(scene)
    need = int(model.search.build(state.position).fluid.largest_count)
    fluid = dataclasses.replace(model.search.fluid, capacity=need - 1)
    short = dataclasses.replace(model, search=dataclasses.replace(model.search, fluid=fluid))
    expected, _ = measure(model, START, state)
    found, _ = measure(short, START, state)
    for name in expected:
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-9, atol=1e-9)
    traced = jax.jit(lambda x: measure(short, START, x)[0]["walls"])(state)
    assert np.isnan(traced).all()


def test_loop_is_the_same_with_and_without_named_parts():
    """Forces are measured at snapshots by a program of their own."""
    named = conserving(vessel(DeltaPlus()))
    plain = dataclasses.replace(named, walls=dataclasses.replace(named.walls, parts=()))

    def program(scene):
        model = scene.model()
        run = jax.jit(lambda y: integrate(model, y, jnp.asarray(0), jnp.asarray(1e-3), 2, 1))
        return run.lower(scene.state).as_text()

    assert program(named) == program(plain)


def test_without_walls_nothing_is_measured():
    scene = taylor_green(12, end_time=0.03, arrangement=jaxsph.arrangements.Lattice())
    assert WallForces.of(scene) is None
    assert jaxsph.run_scene(scene).forces == {}


# ------------------------------------------------------------------ files


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = tmp_path_factory.mktemp("run") / "trajectory.h5"
    return path, jaxsph.run_scene(vessel(Consistent()), path)


@pytest.mark.run_once
def test_forces_are_kept_with_each_snapshot(run):
    path, trajectory = run
    again = read_trajectory(path)
    assert set(again.forces) == {"walls", "ball", "bottom"}
    with h5py.File(path, "r") as file:
        assert file["forces/ball"].shape == (len(again.time), 2)
        assert file["torques/ball"].shape == (len(again.time),)
        np.testing.assert_array_equal(file["forces/time"], again.time)
        attributes = dict(file["forces/ball"].attrs)
    late = again.time > 0.8 * again.time[-1] + 1e-9
    mean = again.mean_forces["ball"][late].mean(axis=0)
    found = [attributes["drag_coefficient"], attributes["lift_coefficient"]]
    assert found == pytest.approx(2.0 * mean / (1000.0 * 0.5**2 * 0.4))  # per metre of depth
    assert (attributes["reference_length"], attributes["reference_speed"]) == (0.4, 0.5)
    scene = vessel(Consistent())
    forces, _ = WallForces.of(scene)(scene.model(), START, scene.state)
    np.testing.assert_allclose(trajectory.forces["ball"][0], forces["ball"], rtol=1e-12, atol=1e-9)
    blocks = list(snapshot_blocks(path, 2))
    whole = np.concatenate([block.forces["ball"] for block in blocks])
    np.testing.assert_array_equal(whole, again.forces["ball"])
    np.testing.assert_array_equal(again.snapshot(-1).torques["ball"], again.torques["ball"][-1])


def test_forces_are_told(run, capsys, tmp_path):
    path, trajectory = run
    assert main(["show", str(path)]) == 0
    shown = capsys.readouterr().out
    assert "force on ball" in shown and "torque on ball" in shown
    assert "drag coefficient" in shown and "of 0.5 m/s and 0.4 m" in shown
    told = read_overview(path).forces["ball"]
    np.testing.assert_array_equal(told["last_force"], trajectory.forces["ball"][-1])
    np.testing.assert_array_equal(told["last_torque"], trajectory.torques["ball"][-1])
    assert main(["show", str(path), "--json", str(tmp_path / "show.json")]) == 0
    written = json.loads((tmp_path / "show.json").read_text())["forces"]["ball"]
    assert written == told


def test_report_has_drag_and_lift_over_time(run, tmp_path):
    path, trajectory = run
    figures = forces_figure({k: v for k, v in read_forces(path).items() if k != "walls"})
    drag, lift = figures.axes
    assert [axes.get_ylabel() for axes in (drag, lift)] == ["drag coefficient", "lift coefficient"]
    scale = 2.0 / (1000.0 * 0.5**2 * 0.4)
    ball = drag.lines[0].get_ydata()
    np.testing.assert_allclose(ball[1:], scale * trajectory.mean_forces["ball"][1:, 0])
    assert ball[0] == ball[1], "a mean is drawn over its interval"
    written = write_run_report(tmp_path / "report.html", path, 1.0, {}, {})
    assert "Force on each named body" in checked_page(written).text
    unknown = read_forces(trajectory.save(tmp_path / "copy.h5"))  # has no reference
    drag, lift = forces_figure(unknown).axes
    assert lift.get_ylabel() == "lift force [N/m]"
    np.testing.assert_array_equal(
        lift.lines[0].get_ydata()[1:], trajectory.mean_forces[lift.lines[0].get_label()][1:, 1]
    )


def test_saved_trajectory_keeps_forces(run, tmp_path):
    _, trajectory = run
    copy = read_trajectory(trajectory.save(tmp_path / "copy.h5"))
    np.testing.assert_array_equal(copy.forces["ball"], trajectory.forces["ball"])
    np.testing.assert_array_equal(copy.torques["walls"], trajectory.torques["walls"])


def test_resumed_run_has_the_forces_of_an_unbroken_one(tmp_path, capsys):
    arguments = ["run", "hydrostatic-tank", "--resolution", "16"]
    short, whole = (tmp_path / name / "trajectory.h5" for name in ("short", "whole"))
    assert main([*arguments, "--t-end", "0.6", "--out", str(short.parent)]) == 0
    resumed = ["run", "hydrostatic-tank", "--resume", str(short)]
    assert main([*resumed, "--t-end", "1.2"]) == 0
    assert main([*arguments, "--t-end", "1.2", "--out", str(whole.parent)]) == 0
    branch = tmp_path / "branch"
    assert main([*resumed, "--from-step", "80", "--t-end", "1.2", "--out", str(branch)]) == 0
    expected = read_trajectory(whole)
    for path in (short, branch / "trajectory.h5"):
        found = read_trajectory(path)
        np.testing.assert_allclose(found.forces["walls"], expected.forces["walls"], atol=1e-6)
        with h5py.File(path, "r") as file:
            np.testing.assert_array_equal(file["forces/time"], file["time"])
            assert np.isfinite(file["forces/walls"].attrs["lift_coefficient"])


# ------------------------------------------------------------------ bad input


@pytest.mark.parametrize(
    "change, message",
    [
        (lambda: WallPart("time", BallRegion((0.0, 0.0), 1.0)), "'time' cannot be used"),
        (lambda: WallPart("a/b", BallRegion((0.0, 0.0), 1.0)), "without a slash"),
        (lambda: WallPart("a", BallRegion((0.0, 0.0), 1.0), reference_length=0.0), "positive"),
    ],
)
def test_bad_parts_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        change()


@pytest.mark.parametrize(
    "regions, message",
    [([0.2, 0.2], "two have the name"), ([1e-3], "no ghost lies in")],
)
def test_parts_that_hold_nothing_or_twice_are_refused(regions, message):
    space, disc = vessel(Consistent()).space, BallRegion((0.5, 0.5), 0.2)
    parts = [WallPart("ball", BallRegion((0.5, 0.5), radius)) for radius in regions]
    region = BoxRegion((0.0, 0.0), (1.0, 1.0)) & ~disc
    with pytest.raises(ValueError, match=message):
        jaxsph.Walls.around(region, space, parts=parts)


@pytest.mark.slow
def test_a_tank_with_dry_walls_gets_what_its_water_loses():
    """Ghosts above the water line have no volume; their empty slots gave forces of NaN."""
    scene = sloshing(24)
    model, state, walls = scene.model(), scene.state, WallForces.of(scene)
    rates = model.functional(START, state, model.prepare(state))
    lost = -float(scene.mass) * (np.asarray(rates.velocity)[:, 1] + 9.81).sum()
    assert float(walls(model, START, state)[0]["walls"][1]) == pytest.approx(lost, rel=1e-9)

    def upward(state):
        force, torque = walls(model, START, state)
        return force["walls"][1] + torque["walls"]

    assert np.isfinite(np.asarray(jax.grad(upward)(state).density)).all()
