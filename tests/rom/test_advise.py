"""`jaxsph-rom advise`: the cheapest within an error, and one clear line for bad input."""

import json

import pytest

from jaxsph_rom.advice import Row, advise, percent, read_table, seconds
from jaxsph_rom.cli import main


def row(label, velocity, pressure, run, offline=None):
    family = "full" if offline is None else "tensor"
    return Row(family, label, velocity, pressure, run, 1.0, offline, f"run {label}")


ROWS = [
    row("coarse", 8.0, 40.0, 1.0),
    row("fine", 1.0, 5.0, 20.0),
    row("reduced", 2.0, 4.0, 0.01, 99.0),
    row("slow", 0.5, 3.0, 300.0),
]


@pytest.fixture
def table(tmp_path):
    path = tmp_path / "table.json"
    scene = {
        "reynolds": 100.0,
        "end_time": 1.0,
        "reference": "the exact solution",
        "rows": [vars(r) for r in ROWS],
    }
    machine = {"processor": "An abacus", "cores": 2, "system": "Linux"}
    versions = {"jaxsph": "0.1.0", "jax": "0.10"}
    path.write_text(
        json.dumps({"scenes": {"taylor-green": scene}, "machine": machine, "versions": versions})
    )
    return path


def test_the_cheapest_within_the_errors():
    assert advise(ROWS, velocity=10.0).best.label == "reduced"
    assert advise(ROWS, velocity=1.5).best.label == "fine"
    assert advise(ROWS, pressure=3.5).best.label == "slow"
    assert advise(ROWS, velocity=1.5, pressure=4.5).best.label == "slow"
    assert advise(ROWS, velocity=9.0, budget=5.0).reached


def test_what_answers_the_same_without_training():
    found = advise(ROWS, velocity=9.0)
    assert found.untrained.label == "coarse" and found.paid_back_after == 100
    assert advise(ROWS, velocity=1.5).untrained is None
    assert advise(ROWS, velocity=1.5).paid_back_after is None


def test_the_most_accurate_within_a_time():
    assert advise(ROWS, budget=30.0).best.label == "fine"
    assert advise(ROWS, budget=0.5).best.label == "reduced"
    nearest = advise(ROWS, budget=1e-3)
    assert not nearest.reached and nearest.best.label == "reduced"


def test_where_none_is_within():
    found = advise(ROWS, velocity=0.1)
    assert not found.reached and found.best.label == "slow"
    found = advise(ROWS, velocity=0.6, budget=30.0)
    assert not found.reached and found.best.label == "fine"  # the nearest that can be afforded
    with pytest.raises(ValueError, match="--velocity-error"):
        advise(ROWS)


@pytest.mark.parametrize("text, value", [("1%", 1.0), ("0.5", 0.5), (" 2 % ", 2.0), ("1e1%", 10.0)])
def test_percent(text, value):
    assert percent(text) == value


@pytest.mark.parametrize(
    "text, value", [("10s", 10.0), ("10", 10.0), ("200ms", 0.2), ("2 min", 120.0), ("1h", 3600.0)]
)
def test_seconds(text, value):
    assert seconds(text) == pytest.approx(value)


def test_an_answer_from_one_line(table, tmp_path, capsys):
    path = tmp_path / "a.json"
    line = ["advise", "taylor-green", "--table", str(table), "--json", str(path)]
    assert main([*line, "--velocity-error", "9%", "--pressure-error", "50%"]) == 0
    shown = capsys.readouterr().out
    assert "run reduced" in shown and "An abacus, cores used: 2" in shown
    assert "paid back after 100 runs" in shown and "the exact solution" in shown
    written = json.loads(path.read_text())
    assert written["best"]["label"] == "reduced" and written["reached"]
    assert main([*line[:-2], "--velocity-error", "0.1%", "--time-budget", "1min"]) == 1
    first = capsys.readouterr().out.splitlines()[0]
    assert first == (
        "None of 4 settings is within 0.1 % in velocity, within 60 s. The best there is:"
    )


@pytest.mark.parametrize(
    "arguments, word",
    [
        (["taylor-green", "--velocity-error", "x"], "--velocity-error: give a percentage as 1%"),
        (["taylor-green", "--velocity-error=-1%"], "above zero; got '-1%'"),
        (["taylor-green", "--velocity-error", "nan"], "above zero"),
        (["taylor-green", "--time-budget", "10 fortnights"], "--time-budget: give a time as 10s"),
        (["taylor-green"], "give --velocity-error, --pressure-error or --time-budget"),
        (["no-such-scene", "--velocity-error", "1"], "'no-such-scene' was not measured; there are"),
        (["taylor-green", "--velocity-error", "1", "--table", "/dev/null"], "no table"),
        (["taylor-green", "--velocity-error", "1", "--table", "no.json"], "no table"),
    ],
)
def test_bad_input_is_one_line_and_code_2(capsys, arguments, word):
    assert main(["advise", *arguments]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and word in error


def test_every_answer_of_the_shipped_table_is_what_was_asked(capsys):
    for name, scene in read_table()["scenes"].items():
        rows = scene["rows"]
        assert rows
        for wanted in (0.2, 0.5, 1.0, 3.0, 10.0, 100.0):
            for pressure in (None, 2.0, 50.0):
                found = advise(rows, wanted, pressure)
                within = [
                    r for r in rows
                    if r.velocity_percent <= wanted
                    and (pressure is None or r.pressure_percent <= pressure)
                ]  # fmt: skip
                assert found.reached == bool(within)
                if within:
                    assert found.best in within
                    assert found.best.seconds == min(r.seconds for r in within)
        for budget in (1e-6, 0.1, 10.0, 1e4):
            found = advise(rows, budget=budget)
            within = [r for r in rows if r.seconds <= budget]
            assert found.reached == bool(within)
            if within:
                assert found.best.velocity_percent == min(r.velocity_percent for r in within)
        for r in rows:
            assert r.command and r.seconds > 0 and r.velocity_percent > 0 and r.label
            assert (r.offline_seconds is None) == (r.family == "full")
        assert main(["advise", name, "--velocity-error", "100%"]) == 0
    assert "cores" in capsys.readouterr().out
