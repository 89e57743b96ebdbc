"""The report from plain numbers: a decaying Taylor-Green vortex and what runs of it could give."""

import dataclasses
import json
import math
import struct
import sys

import matplotlib
import numpy as np
import pytest

from jaxsph import Box
from jaxsph.plotting.style import shared_limits
from jaxsph_rom.report import (
    Case,
    Profile,
    centre_line_profiles,
    discrepancy_history,
    field_differences,
    field_snapshots,
    format_table,
    modes,
    singular_values,
    write_report,
)
from jaxsph_rom.report.figures.differences import linear_fit
from jaxsph_rom.report.figures.spectrum import missing_energy

DENSITY, SOUND = 1000.0, 10.0  # kg/m^3, m/s
WAVE = 2 * np.pi  # 1/m


def taylor_green(x, t, reynolds):
    """Velocity (N, 2) [m/s] and pressure (N,) [Pa] of the decaying vortex."""
    decay = np.exp(-2 * WAVE**2 * t / reynolds)
    a, b = WAVE * x.T
    velocity = decay * np.stack([np.sin(a) * np.cos(b), -np.cos(a) * np.sin(b)], axis=-1)
    return velocity, DENSITY / 4 * decay**2 * (np.cos(2 * a) + np.cos(2 * b))


def lattice(side):
    middle = (np.arange(side) + 0.5) / side
    return np.stack(np.meshgrid(middle, middle, indexing="ij"), axis=-1).reshape(-1, 2)


def trajectory(side=32, reynolds=100.0, steps=40):
    """Times (S,), positions (S, N, 2) of particles carried by the exact field, which they hold."""
    x = lattice(side) + np.random.default_rng(0).normal(0, 0.1 / side, (side**2, 2))
    times = np.linspace(0, 1, steps)
    positions = [x]
    for t, step in zip(times[:-1], np.diff(times), strict=True):
        half = x + 0.5 * step * taylor_green(x, t, reynolds)[0]
        x = (x + step * taylor_green(half, t + 0.5 * step, reynolds)[0]) % 1.0
        positions.append(x)
    return times, np.stack(positions)


def state(x, t, reynolds=100.0):
    """Density and velocity (N, 3)."""
    velocity, pressure = taylor_green(x, t, reynolds)
    return np.column_stack([DENSITY + pressure / SOUND**2, velocity])


def decomposition(snapshots):
    """Modes (N, 3, K) and singular values (K,) of fluctuations (S, N, 3)."""
    matrix = (snapshots - [DENSITY, 0, 0]).reshape(len(snapshots), -1).T
    left, sigma, _ = np.linalg.svd(matrix, full_matrices=False)
    return left.reshape(*snapshots.shape[1:], -1), sigma


@pytest.fixture(scope="module")
def vortex():
    times, positions = trajectory()
    grid = lattice(32)
    noise = np.random.default_rng(1)
    moving = np.stack([state(x, t) for x, t in zip(positions, times, strict=True)])
    still = np.stack([state(grid, t) for t in times])
    still += noise.normal(0, 1e-4, still.shape)
    return times, positions, grid, decomposition(moving), decomposition(still)


def profile(reynolds, blown_up=False):
    y = np.linspace(0, 1, 120)
    velocity, pressure = taylor_green(np.column_stack([np.full_like(y, 0.5), y]), 0.5, reynolds)
    speed = np.linalg.norm(velocity, axis=1)
    wiggle = np.sin(10 * WAVE * y) * (1e9 if blown_up else 1.0)
    curves = {
        "full": (speed * 1.01, pressure * 0.98),
        "Galerkin": (speed * 1.02 + 0.02 * wiggle, pressure + 8 * wiggle),
        "Petrov-Galerkin": (speed * 0.98, pressure * 0.93),
        "analytic": (speed, pressure),
    }
    return Profile(reynolds=reynolds, coordinate=y, curves=curves, time=0.5)


def case(**changes):
    values = {
        "scene": "taylor-green",
        "reynolds": 125.0,
        "modes": 5,
        "projection": "apg",
        "tau": 1e-4,
        "inner_product": "energy",
        "hyper": "tensor",
        "trained_on": (100.0, 150.0, 200.0, 250.0),
        "velocity_peak_percent": 3.21,
        "velocity_median_percent": 1.234,
        "pressure_peak_percent": 6.5,
        "pressure_median_percent": 2.05,
        "stable": True,
        "fom_seconds": 42.25,
        "rom_seconds": 0.125,
        "fom_steps": 2000,
        "rom_steps": 2000,
        "fom_compile_seconds": 3.5,
        "rom_compile_seconds": 1.5,
        "compression_factor": 3686.4,
    }
    return Case(**(values | changes))


def unstable_case():
    return case(
        reynolds=150.0,
        modes=10,
        projection="galerkin",
        tau=None,
        velocity_peak_percent=math.inf,
        pressure_peak_percent=math.nan,
        stable=False,
        fault="density of particle 17 out of bounds at step 680",
        fault_time=0.34,
    )


def strict(text):
    def refuse(name):
        raise AssertionError(f"{name} is not JSON")

    return json.loads(text, parse_constant=refuse)


def test_report_comes_back(tmp_path):
    cases = [case(), unstable_case()]
    energy = {"reference": np.array([99.9, 99.996, np.nan]), "modes": (np.int64(2), 5)}
    environment = {"device": "cpu", "x64": np.bool_(True)}
    path = write_report(tmp_path / "out" / "report.json", cases, environment, {"energy": energy})
    report = strict(path.read_text())
    assert report["schema_version"] == 1
    assert report["environment"] == {"device": "cpu", "x64": True}
    assert report["energy"] == {"reference": [99.9, 99.996, None], "modes": [2, 5]}
    again = Case(**report["cases"][0] | {"trained_on": tuple(report["cases"][0]["trained_on"])})
    assert again == cases[0]
    assert [file.name for file in path.parent.iterdir()] == ["report.json"]


def test_folder_gets_report_json(tmp_path):
    assert write_report(tmp_path, [case()], {}) == tmp_path / "report.json"


def test_failed_write_keeps_the_old_report(tmp_path):
    path = write_report(tmp_path, [case()], {})
    before = path.read_text()
    with pytest.raises(ValueError, match="JSON cannot hold"):
        write_report(tmp_path, [case()], {"device": object()})
    with pytest.raises(ValueError, match="extra: cases"):
        write_report(tmp_path, [case()], {}, {"cases": []})
    assert path.read_text() == before


@pytest.mark.parametrize(
    "field", ["velocity_peak_percent", "pressure_median_percent", "rom_seconds", "tau"]
)
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, np.float32(np.nan)])
def test_a_number_that_is_none_is_unstable(field, value):
    odd = case(**{field: value})
    values = odd.to_dict()
    assert values[field] is None
    assert values["stable"] is False
    assert not odd.sound and odd.time_ratio is None
    assert "unstable" in format_table([odd]) and "nan" not in format_table([odd])


def test_not_measured_is_not_unstable():
    values = case(fom_compile_seconds=None, fom_seconds=None).to_dict()
    assert values["stable"] is True and values["fom_seconds"] is None


def test_array_scalars_become_numbers():
    values = case(velocity_peak_percent=np.float32(0.5), modes=np.int64(5)).to_dict()
    assert type(values["velocity_peak_percent"]) is float and type(values["modes"]) is int


def test_table_has_errors_and_times_in_one_row():
    lines = format_table([case(), case(reynolds=100.0, projection="galerkin", tau=None)]).split(
        "\n"
    )
    row = next(line for line in lines if line.split()[:1] == ["125"])
    expected = "125 predicted 5 apg 1e-4 3.21 1.23 6.50 2.05 42.2 0.125 338 yes"
    assert row.split() == expected.split()
    assert any(line.split()[:5] == ["100", "trained", "5", "galerkin", "-"] for line in lines)
    assert sum("taylor-green" in line for line in lines) == 1


def test_table_is_aligned_and_narrow():
    wide = case(
        reynolds=123456.0,
        projection="adjoint-petrov-galerkin-with-a-long-name",
        velocity_peak_percent=1.234e9,
        pressure_peak_percent=0.000123456,
        fom_seconds=86399.7,
        rom_seconds=1234567.0,
        tau=1.23456e-7,
        stable=False,
        fault_time=0.123456,
        fault="diverged " * 40,
    )
    text = format_table([wide, case(), unstable_case(), case(hyper="none")])
    assert max(map(len, text.split("\n"))) <= 120
    rows = [line for line in text.split("\n") if line.endswith(("yes", " s"))]
    ends = {line.find(word) for line in rows for word in ("yes", "unstable") if word in line}
    assert len(rows) == 4 and len(ends) == 1


def test_table_says_when_and_why_a_run_failed():
    text = format_table([unstable_case()])
    assert "unstable, 0.34 s" in text
    assert "Re 150, M 10, galerkin: density of particle 17 out of bounds at step 680" in text
    assert "inf" not in text and "nan" not in text
    assert format_table([]).count("\n") == 2  # a header and its rule


def test_missing_energy_keeps_its_digits():
    sigma = np.array([1.0, 1e-6, 1e-12, 1e-18])
    missing = missing_energy(sigma)
    # 1e-12: round-off of a sum of three terms of one sign, relative.
    np.testing.assert_allclose(missing[1], 100 * (1e-12 + 1e-18) / sigma.sum(), rtol=1e-12)
    assert missing[-1] == 0 and (np.diff(missing) < 0).all()


def test_limits_ignore_a_run_that_blew_up():
    reference, fine, wild = np.array([0.0, 1.0]), np.array([-0.2, 1.5]), np.array([1e30, np.nan])
    assert shared_limits([reference, fine], 0.75) == (-0.2, 1.5)
    assert shared_limits([reference, fine, wild], 0.75) == (-0.2, 1.75)
    low, high = shared_limits([np.ones(3)], 0.75)
    assert low < 1 < high


def draw_discrepancy(vortex, path):
    times = vortex[0]
    velocity = 2 + 3 * times**2 + 0.3 * np.sin(40 * times)
    wild = np.where(times < 0.6, 0.05 * np.exp(20 * times), np.nan)
    start = np.where(times > 0, 1.0, 0.0)
    return discrepancy_history(
        [
            ("Galerkin, M = 5, Re 125", times, velocity * start, 3 * velocity * start),
            ("Petrov-Galerkin, M = 5, Re 125", times, 0.4 * velocity, 1.5 * velocity),
            ("Galerkin, M = 10, Re 125", times, wild, 10 * wild),
        ],
        path,
        [(0.3 * velocity, velocity), None, (0.02 * velocity, 0.1 * velocity)],
    )


def draw_profiles(vortex, path):
    return centre_line_profiles([profile(125.0), profile(175.0), profile(225.0, True)], path)


def draw_singular_values(vortex, path):
    return singular_values(vortex[3][1], vortex[4][1], path)


def draw_modes(vortex, path):
    _, positions, grid, (moving, _), (still, _) = vortex
    spaces = [("Lagrangian space", positions[0], moving), ("reference space", grid, still)]
    return modes(spaces, (1, 5, 10), path)


def draw_fields(vortex, path):
    times, positions = vortex[:2]
    velocity, pressure = taylor_green(positions[4], times[4], 100.0)
    speed = np.linalg.norm(velocity, axis=1)
    wild = np.where(positions[4][:, 0] > 0.8, np.nan, pressure * 4)
    return field_snapshots(
        [
            ("full", positions[4], speed, pressure),
            ("Galerkin", positions[4], speed * 1.1, wild),
            ("Petrov-Galerkin", positions[4], speed, 0.9 * pressure),
        ],
        path,
    )


@pytest.mark.parametrize(
    "draw", [draw_discrepancy, draw_profiles, draw_singular_values, draw_modes, draw_fields]
)
def test_figure_is_a_png(vortex, tmp_path, draw):
    settings = dict(matplotlib.rcParams)
    path = draw(vortex, tmp_path / "figures" / "figure.png")
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n" and data[-8:-4] == b"IEND"
    width, height = struct.unpack(">II", data[16:24])
    assert width > 900 and height > 500  # six by three inches at 150 dpi, at the least
    assert len(data) > 20_000
    picture = matplotlib.image.imread(path)[..., :3]
    assert (picture[0] == 1).all() and (picture[:, -1] == 1).all()  # a white margin: nothing cut
    assert (picture.min(axis=-1) < 0.9).mean() > 0.01
    assert dict(matplotlib.rcParams) == settings


def test_figures_leave_pyplot_alone(vortex, tmp_path):
    if "matplotlib.pyplot" not in sys.modules:
        import matplotlib.pyplot  # noqa: F401
    pyplot = sys.modules["matplotlib.pyplot"]
    before = pyplot.get_fignums()
    draw_fields(vortex, tmp_path / "fields.png")
    assert pyplot.get_fignums() == before


def test_differences_are_taken_where_the_reduced_run_is(tmp_path):
    rng = np.random.default_rng(0)
    position, points = rng.random((400, 2)), 0.2 + 0.6 * rng.random((50, 2))
    slope = rng.normal(size=(2, 2))
    found = linear_fit(points, position, position @ slope + 3.0)
    np.testing.assert_allclose(found, points @ slope + 3.0, atol=1e-6)
    waves = np.sin(6.0 * position[:, :1])
    assert np.abs(linear_fit(points, position, waves) - np.sin(6.0 * points[:, :1])).max() < 0.1
    full = ("full", position, np.ones(400), np.zeros(400))
    reduced = ("reduced", points, np.full(50, 1.5), np.full(50, -2.0))
    lost = ("lost", np.full((50, 2), np.nan), np.ones(50), np.ones(50))
    walls = np.array([[x, -0.05] for x in np.linspace(0.0, 1.0, 21)])
    around = {"walls": walls, "box": Box((0.0, 0.0), (1.0, 1.0), (True, False))}
    path = field_differences([full, reduced, lost], tmp_path / "d.png", **around)
    assert field_snapshots([full, reduced], tmp_path / "f.png", **around).exists()
    assert path.read_bytes().startswith(b"\x89PNG")
    with pytest.raises(ValueError, match="rows: got 1"):
        field_differences([full], path)


def test_runs_that_are_all_nan_are_drawn(tmp_path):
    times, x = np.linspace(0, 1, 5), lattice(8)
    lost, gone = np.full(5, np.nan), np.full(64, np.nan)
    assert discrepancy_history([("lost", times, lost, lost)], tmp_path / "a.png").is_file()
    assert field_snapshots([("lost", x, gone, gone)], tmp_path / "b.png").is_file()
    curves = {"full": (lost, lost)}
    assert centre_line_profiles([Profile(100.0, times, curves)], tmp_path / "c.png").is_file()


def test_wrong_shapes_are_named(vortex, tmp_path):
    path = tmp_path / "never.png"
    x, shapes = vortex[2], vortex[4][0]
    with pytest.raises(ValueError, match=r"numbers: got \(1, 99\)"):
        modes([("reference", x, shapes)], (1, 99), path)
    with pytest.raises(ValueError, match=r"shape \(1024, 2, 40\)"):
        modes([("reference", x, shapes[:, :2])], (1,), path)
    with pytest.raises(ValueError, match=r"slice of three-dimensional"):
        field_snapshots([("full", np.ones((4, 3)), np.ones(4), np.ones(4))], path)
    with pytest.raises(ValueError, match=r"one value per particle"):
        field_snapshots([("full", x, np.ones(4), np.ones(4))], path)
    with pytest.raises(ValueError, match=r"both must be \(S,\)"):
        discrepancy_history([("run", np.ones(3), np.ones(2), np.ones(3))], path)
    run = ("run", np.ones(3), np.ones(3), np.ones(3))
    with pytest.raises(ValueError, match="floors: got 2 for 1 histories"):
        discrepancy_history([run], path, [None, None])
    with pytest.raises(ValueError, match="floor of run"):
        discrepancy_history([run], path, [(np.ones(3), np.ones(2))])
    with pytest.raises(ValueError, match=r"one value per probe"):
        wrong = dataclasses.replace(profile(100.0), coordinate=np.ones(3))
        centre_line_profiles([wrong], path)
    with pytest.raises(ValueError, match=r"Lagrangian space: got singular values"):
        singular_values(np.array([1.0, np.nan]), np.ones(2), path)
    assert not path.exists()
