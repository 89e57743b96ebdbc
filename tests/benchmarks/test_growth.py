"""Cost of growth: slopes of known curves, and every family at a tiny size."""

import json
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks import growth
from benchmarks.growth import (
    FULL,
    GRADIENT,
    LIST,
    MOVING,
    NEIGHBORS,
    RATES,
    RUN,
    STEP,
    TENSORS,
    Case,
    curve,
    fourier_basis,
    measured,
)
from jaxsph.arrangements import JitteredLattice, Lattice
from jaxsph.scenes import taylor_green

TINY = (
    (Case(FULL, 256, 2.0), {STEP, LIST, RATES}),
    (Case(NEIGHBORS, 256, 1.5), {STEP, LIST, RATES}),
    (Case(MOVING, 256, 2.0, 3), {STEP, LIST, RATES}),
    (Case(TENSORS, modes=3), {STEP}),
    (Case(GRADIENT, 256, 2.0, steps=2), {RUN, GRADIENT}),
)


def made_up(family, programs, seconds, peak=1.0, **numbers):
    case = Case(family, **numbers)
    program = {
        "median": seconds, "min": seconds, "spread": 0.0, "processor": seconds,
        "compile_seconds": 2.0, "peak_gib": 0.25 + peak, "temp_gib": 0.1,
    }  # fmt: skip
    return {
        "case": vars(case) | {},
        "start_gib": 0.25,
        "neighbors": 50.0,
        "programs": dict.fromkeys(programs, program),
    }


def rows(power):
    """Time that grows as a power of N from 10^4 on, and memory with N; below that, worthless."""
    sizes = (10**6, 10**3, 10**4, 10**5)
    seconds = {n: 9.9 if n < 10**4 else 1e-5 * n**power for n in sizes}
    return [made_up(FULL, (STEP, RATES), seconds[n], n * 1e-6, particles=n) for n in sizes]


def found(results, quantity, program=STEP):
    (one,) = [g for g in results if (g["quantity"], g["program"]) == (quantity, program)]
    return one


def test_slopes_between_ten_thousand_and_a_million():
    results = growth.growth(rows(1.1))
    time = found(results, "seconds")
    assert time["slope"] == pytest.approx(1.1, rel=1e-12)  # round-off of logarithms
    assert (time["from"], time["to"]) == (1e4, 1e6)
    assert time["deviation_percent"] == pytest.approx(100.0 * (100.0**0.1 - 1.0), rel=1e-12)
    assert found(results, "peak memory")["slope"] == pytest.approx(1.0, rel=1e-12)
    assert found(results, "compile seconds")["slope"] == pytest.approx(0.0, abs=1e-12)
    assert not [g for g in results if (g["quantity"], g["program"]) == ("peak memory", RATES)]


def test_a_fall_has_a_sign():
    time = found(growth.growth(rows(0.9)), "seconds")
    assert time["deviation_percent"] == pytest.approx(100.0 * (100.0**-0.1 - 1.0), rel=1e-12)


def test_curves_are_in_order():
    x, y = curve(rows(1.0), FULL, STEP, "seconds")
    np.testing.assert_array_equal(x, [1e3, 1e4, 1e5, 1e6])
    np.testing.assert_allclose(y[1:], 1e-5 * x[1:], rtol=1e-12)


def test_the_figure(tmp_path):
    table = [
        *rows(1.0),
        *(made_up(TENSORS, (STEP,), 1e-6 * m**2, modes=m) for m in (5, 10)),
        *(made_up(GRADIENT, (RUN, GRADIENT), 0.1 * s, steps=s) for s in (10, 20)),
    ]
    results = {"rows": table, "growth": growth.growth(table)}
    path = growth.figure(results, tmp_path / "f.png")
    assert path.stat().st_size > 20_000
    assert "tensors" in growth._table(results)


def test_fourier_modes_are_orthonormal_and_make_the_vortex():
    scene = taylor_green(16, h_over_dx=2.0, arrangement=JitteredLattice())
    points = np.asarray(Lattice().positions(scene.space))
    basis = fourier_basis(scene, points, 6)
    weighted = basis.modes * basis.weights[None, :, None]
    gram = np.einsum("gfm,gfn->mn", weighted, basis.modes)
    np.testing.assert_allclose(gram, np.eye(6), atol=1e-13)  # round-off of 256 terms
    vortex = taylor_green(16, h_over_dx=2.0, arrangement=Lattice()).state.velocity
    coordinates = np.einsum("gfm,gf->m", basis.modes[:, 1:], vortex)
    made = np.einsum("gfm,m->gf", basis.modes[:, 1:], coordinates)
    np.testing.assert_allclose(made, vortex, atol=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize(("case", "programs"), TINY, ids=[case.family for case, _ in TINY])
def test_every_family(case, programs):
    row = measured(case, repeats=1)
    assert row["programs"].keys() == programs
    assert row["start_gib"] > 0.0
    for program in row["programs"].values():
        assert 0.0 < program["min"] <= program["median"] and program["compile_seconds"] > 0.0
        assert program["peak_gib"] >= row["start_gib"] and program["temp_gib"] > 0.0
        assert program["processor"] > 0.0 and program["repeats"] >= 1
    if case.family == GRADIENT:  # it keeps what every step needs on the way back
        assert row["programs"][GRADIENT]["temp_gib"] > row["programs"][RUN]["temp_gib"]
    if case.family in (FULL, MOVING):
        assert 45 < row["neighbors"] < 52 < row["list_capacity"]  # pi 4^2 - 1 = 49
        assert row["cells"] == 36  # 16 / 2.41 spacings, along two directions
    assert json.dumps(row)


@pytest.mark.slow
def test_finished_cases_are_not_run_again(tmp_path, capsys, monkeypatch):
    path, image = tmp_path / "growth.json", tmp_path / "growth.png"
    arguments = ["--quick", "--repeats", "1", "--json", str(path), "--figure", str(image)]
    arguments += ["--families", "tensors"]
    monkeypatch.setattr(growth, "QUICK", ((144,), (2,), (2,)))
    assert growth.main(arguments) == 0
    read = json.loads(path.read_text())
    assert [row["case"]["modes"] for row in read["rows"]] == [2, 4, 8]
    assert {"versions", "machine", "device"} <= read["environment"].keys()
    assert found(read["growth"], "seconds")["to"] == 8 and image.exists()
    assert "0 of 3 cases done before" in capsys.readouterr().err
    read["rows"].pop()
    path.write_text(json.dumps(read))
    assert growth.main(arguments) == 0
    assert "2 of 3 cases done before" in capsys.readouterr().err
    again = json.loads(path.read_text())
    assert again["rows"][:2] == read["rows"] and len(again["rows"]) == 3
    again["environment"]["machine"]["cores"] += 1
    path.write_text(json.dumps(again))
    assert growth.main(arguments) == 2
    assert "of another machine" in capsys.readouterr().err


def test_all_cases():
    every = growth.cases(
        SimpleNamespace(particles=None, families=tuple(growth.ALONG), kind="full")
    )
    assert {case.particles for case in every if case.family == FULL} == {
        1024, 3025, 10_000, 29_929, 99_856, 300_304, 1_000_000
    }  # fmt: skip
    assert {case.modes for case in every if case.family == TENSORS} == {5, 10, 20, 40, 80, 160}
    assert {case.h_over_dx for case in every if case.family == NEIGHBORS} == {1.5, 2.0, 3.0, 4.0}
    steps = [case.steps for case in every if case.family == GRADIENT]
    assert steps == [10, 20, 40, 80, 160, 320]
    assert len(set(every)) == len(every)


def test_a_failed_run_is_told():
    with pytest.raises(ValueError, match="NOT_FINITE"):
        growth._good((None, jnp.asarray(int(growth.FaultCode.NOT_FINITE))))
