"""Bad input to any command: one line that says what to do, exit code 2, and nothing left behind."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import jaxsph
import jaxsph_rom
from jaxsph.arrangements import Lattice
from jaxsph_command import main
from tests.runs import random_run

SCENES = """
import jaxsph

def drop(amplitude: float = 0.01, resolution: int = 16):
    arrangement = jaxsph.arrangements.JitteredLattice(amplitude)
    return jaxsph.scenes.taylor_green(resolution, end_time=0.02, arrangement=arrangement)

def fails(amplitude=1.0):
    return {}[amplitude]

def nothing(amplitude=1.0):
    return None

def stops(amplitude=1.0):
    raise SystemExit(3)
"""
RUN = "run taylor-green --resolution 16 --arrangement lattice --t-end 0.02"
TRAIN = "train taylor-green --resolution 16 --arrangement lattice --t-end 0.04 --modes 2"
COMPARE = "run taylor-green --resolution 16 --arrangement lattice --t-end 0.04 --hyper none"

# command line: what its error must say
FULL = {
    # no command, or none that there is
    "": "COMMAND",
    "rum": "did you mean run?",
    "--colour": "COMMAND",
    # scenes
    "scenes dam-braek": "did you mean dam-break?",
    "scenes taylor-green --scale huge": "--scale: invalid choice: 'huge'",
    "scenes nowhere.py": "there is no file nowhere.py",
    "scenes scenes.py:drop --scale small": "--scale: the scene has none",
    "scenes taylor-green dam-break": "dam-break",
    # run: the scene
    "run": "SCENE",
    "run taylor-grene": "did you mean taylor-green?",
    "run broken.py": "broken.py, line 2: ZeroDivisionError",
    "run wrong.py": "wrong.py, line 1: SyntaxError",
    "run folder.py": "there is no file folder.py",
    "run scenes.py": "it has drop, fails, nothing, stops",
    "run scenes.py:dorp": "did you mean drop?",
    "run scenes.py:fails": "KeyError",
    "run scenes.py:stops": "scenes.py, line 15: SystemExit: 3",
    "run stops.py": "stops.py, line 2: SystemExit: 4",
    "run scenes.py:nothing": "let it return a jaxsph Scene",
    "run --resolution 16 scenes.py:drop --amplitude x": "--amplitude",
    # run: its settings
    "run scenes.py:drop --amplitude nan": "--amplitude: must be finite",
    "run scenes.py:drop --reynolds 5": "--reynolds: scene scenes.py:drop",
    "run dam-break --alhpa 0.1": "did you mean --alpha?",
    "run dam-break --alpha": "--alpha: expected one argument",
    "run dam-break --alpha much": "--alpha: invalid",
    "run dam-break --alpha -1": "alpha",
    "run dam-break --column 0.1": "--column: expected 2 arguments",
    "run dam-break --column 1 2": "column",
    "run dam-break --column -0.1 0.1": "column",
    "run dam-break --tank 0.2 nan": "--tank: must be finite",
    "run dam-break --set alpha": "--set: give NAME=VALUE",
    "run dam-break --set alhpa=1": "did you mean alpha?",
    "run dam-break --set kernel=Gauss": "kernel: 'Gauss' is not known",
    "run dam-break --set kernel=3": "kernel",
    "run dam-break --set tank=wide": "--set: tank is 2 values, each a finite number, got 'wide'",
    "run dam-break --set tank=(1,)": "--set: tank is 2 values, each a finite number, got (1,)",
    "run dam-break --set alpha=much": "--set: alpha is a finite number, got 'much'",
    "run dam-break --set alpha=None": "--set: alpha is a finite number, got None",
    "run dam-break --set resolution=2.5": "--set: resolution is a whole number, got 2.5",
    "run dam-break --set end_time=1e999": "--set: end_time is a finite number",
    "run dam-break --set scale=7": "--set: scale is a word, got 7",
    "run dam-break --set dtype=float16": "--set: dtype is given by --precision",
    "run lid-driven-cavity --lid loose": "--lid: invalid choice: 'loose'",
    f"{RUN} --reynolds 0": "--reynolds: must be positive",
    f"{RUN} --reynolds inf": "--reynolds: must be positive and finite",
    f"{RUN} --resolution 2.5": "--resolution: invalid",
    f"{RUN} --resolution 3": "too small",
    f"{RUN} --h-over-dx 0.1": "h_over_dx",
    f"{RUN} --time-step 1": "stability limit",
    f"{RUN} --t-end 0": "--t-end: must be positive",
    f"{RUN} --t-end never": "--t-end: invalid",
    f"{RUN} --precision float16": "--precision: invalid choice",
    f"{RUN} --scheme best": "--scheme: invalid choice",
    f"{RUN} --arrangement hexagons": "--arrangement: invalid choice",
    f"{RUN} --seed 4294967296": "--seed: must be from 0",
    f"{RUN} --steps few": "--steps: invalid choice",
    f"{RUN} --devices 0": "--devices: must be at least 1",
    f"{RUN} --devices 999": "devices: asked for 999, JAX has",
    f"{RUN} --capacity-margin 0": "--capacity-margin: must be at least 1",
    f"{RUN} --mach quick": "--mach: invalid",
    f"{RUN} --mach 0": "mach",
    # run: its files
    f"{RUN} --out text": "Not a directory",
    f"{RUN} --out kept": "exists already",
    f"{RUN} --json text/r.json": "Not a directory",
    f"{RUN} --json folder": "is a folder",
    f"{RUN} --config none.toml": "none.toml cannot be read",
    f"{RUN} --config text": "text cannot be read",
    f"{RUN} --config sweep.toml": "is of the command sweep, not of run",
    "run --config table.toml": "scene",
    "run --config unknown.toml": "--colour",
    "run --config set.toml": "--set: give NAME=VALUE, got 5",
    "run --config flag.toml": "--overwrite: ignored explicit argument 'yes'",
    "run --config folder": "folder cannot be read (Is a directory)",
    "run --config": "--config: expected one argument",
    "run taylor-green --resume missing.h5": "no such file",
    "run taylor-green --resume text": "not an HDF5 file",
    "run taylor-green --resume model.h5": "model.h5",
    "run dam-break --resume t.h5": "holds a run of scene taylor-green",
    "run taylor-green --resume t.h5 --reynolds 5": "--reynolds: a resumed run",
    "run taylor-green --resume t.h5 --from-step 3 --out new": "no snapshot of step 3",
    "run taylor-green --from-time 1": "--resume",
    # sweep
    "sweep taylor-green": "--reynolds",
    "sweep taylor-green --reynolds 100:50:3": "START below STOP",
    "sweep taylor-green --reynolds 100:200": "START:STOP:COUNT",
    "sweep taylor-green --reynolds 100 --seed x": "--seed: invalid",
    "sweep taylor-green --reynolds 100 --batch 0": "--batch: must be at least 1",
    "sweep dam-break --reynolds 100": "--reynolds: scene dam-break",
    "sweep taylor-green --reynolds 100 --resolution 16 --arrangement lattice --out t.h5": "t.h5",
    # completion
    "completion": "SHELL",
    "completion zhs": "invalid choice: 'zhs' (did you mean zsh?)",
    "completion bash zsh": "zsh: the command has no such word",
    # show, export, animate
    "show": "FILE",
    "show missing.h5": "no such file",
    "show text": "text",
    "show folder": "folder",
    "show wrong.json": "wrong.json",
    "show t.h5 --figure f.docx": "f.docx",
    "show model.h5 --figure f.png": "is no run",
    "show none.toml": "none.toml: no such file",
    "show picture.png": "picture.png: cannot be read as .png",
    "show plain.html": "plain.html: cannot be read as .html",
    "show colours.toml --figure f.png": "is no run",
    "show folder --figure f.png": "folder",
    "watch missing.h5": "no such file",
    "watch model.h5": "model.h5",
    "watch t.h5 --port 70000": "--port: must be from 0 to 65535",
    "watch t.h5 --seconds 0": "--seconds: must be positive",
    "watch t.h5 --fields colour": "--fields: invalid choice: 'colour'",
    "scenes --json text/s.json": "Not a directory",
    "export model.h5": "model.h5",
    "export t.h5 --fields colour": "--fields: invalid choice: 'colour'",
    "export t.h5 --every -1": "--every: must be at least 1",
    "export t.h5 --out t.h5": "is the trajectory itself",
    "animate text": "text",
    "animate t.h5 --fps x": "--fps: invalid",
    "animate t.h5 --out t.avi": "end with .gif or .mp4",
    "animate t.h5 --field colour": "--field: invalid choice",
}
REDUCED = {
    "": "COMMAND",
    "predcit": "did you mean predict?",
    # run
    "run taylor-green --predict 0": "--predict: must be positive",
    "run dam-break": "--train",
    "run scenes.py:drop --train 100": "has no reynolds",
    f"{COMPARE} --train 100 viscosity=1": "has no viscosity",
    f"{COMPARE} --train 100 200 --predict 150 --modes 500": "500",
    f"{COMPARE} --train 100 --reynolds 5": "give its values by --train reynolds=VALUE,VALUE",
    f"{COMPARE} --train 100 200 --predict 150 --tau long": "--tau: a time in s",
    f"{COMPARE} --train 100 200 --predict 150 --closure linear": "add --hyper tensor",
    f"{COMPARE} --train 100 200 --predict 150 --held-back 100": "--held-back",
    f"{COMPARE} --json folder": "is a folder",
    f"{COMPARE} --out text": "Not a directory",
    # train
    "train": "SCENE",
    "train dam-break": "--train",
    f"{TRAIN} --train 100 --modes 0": "--modes: must be at least 1",
    f"{TRAIN} --train 100,x": "--train",
    f"{TRAIN} --train =5": "--train",
    f"{TRAIN} --train mach=": "--train",
    f"{TRAIN} --train 100 200 --closure cubic": "--closure: invalid choice",
    f"{TRAIN} --train 100 200 --held-back 120": "--held-back: Re 120 must be one of",
    f"{TRAIN} --train 100 mahc=0.1": "did you mean mach?",
    f"{TRAIN} --train 100 200 --modes 90": "modes: 90 asked for",
    f"{TRAIN} --train 100 200 --out text/m.h5": "Not a directory",
    "train scenes.py:drop --train amplitude=0.1 --amplitude 0.2": "is given as a setting",
    "train scenes.py:drop --train ampiltude=0.1,0.2": "did you mean amplitude?",
    # labels
    "labels": "SCENE",
    "labels standing-wave": "--train",
    "labels standing-wave --train amplitude=x": "--train",
    "labels standing-wave --train amplitude=0.03 --modes 0": "--modes: must be at least 1",
    "labels standing-wave --train amplitude=0.03 --samples none": "--samples",
    "labels standing-wave --resolution 16 --train depth=0.1": "has no depth",
    "labels standing-wave --train amplitude=0.03 --out text/m.h5": "Not a directory",
    # predict
    "train scenes.py:drop --train amplitude=0:1:1000000000": "--train: at most 100000 values",
    "train scenes.py:drop --train amplitude=0:1:9999 resolution=1:99999:9999": "99980001",
    "predict": "FILE",
    "predict missing.h5 --reynolds 100": "missing.h5: cannot be read",
    "predict text --reynolds 100": "is not an HDF5 file",
    "predict t.h5 --reynolds 100": "holds no reduced",
    "predict model.h5": "--at: give a value of each parameter",
    "predict model.h5 --reynolds -5": "--reynolds: must be positive",
    "predict model.h5 --at viscosity=1": "--at reynolds=...",
    "predict model.h5 --at reynolds": "--at: NAME=VALUE",
    "predict model.h5 --at reynolds=nan": "finite numbers",
    "predict model.h5 --reynolds 100 --t-end 0.03": "the nearest is",
    "predict model.h5 --reynolds 100:200:200 --fields": "--fields: writes a file for each",
    "predict model.h5 --reynolds 100 --tracers 0": "--tracers: must be at least 1",
    "predict model.h5 --reynolds 100 --t-end 1e12": "--t-end",
    "predict model.h5 --reynolds 100 --out text": "Not a directory",
    "predict model.h5 --reynolds 100 --json folder": "is a folder",
    "show missing.h5": "no such file",
    "show folder": "an empty folder",
    "show model.h5 --figure f.png": "is no run",
    # suggest
    "suggest missing.h5": "cannot be read",
    "suggest t.h5": "holds no reduced",
    "suggest model.h5 --json text/s.json": "Not a directory",
    # completion
    "completion": "SHELL",
    "completion zhs": "invalid choice: 'zhs' (did you mean zsh?)",
    "completion bash zsh": "zsh: the command has no such word",
    # advise
    "advise": "SCENE",
    "advise taylor-green": "give --velocity-error",
    "advise dam-break --velocity-error 1%": "was not measured",
    "advise taylor-green --velocity-error -1": "--velocity-error",
    "advise taylor-green --time-budget 3fortnights": "--time-budget",
    "advise taylor-green --time-budget 3s --table text": "no table of measurements",
    "advise taylor-green --velocity-error 1% --json folder": "is a folder",
}
ALL = [(p, *case) for p, of in (("jaxsph", FULL), ("jaxsph-rom", REDUCED)) for case in of.items()]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with one of everything."""
    folder = tmp_path_factory.mktemp("bad")
    (folder / "text").write_text("text")
    (folder / "wrong.json").write_text("{")
    (folder / "kept").mkdir()
    (folder / "kept" / "trajectory.h5").write_text("precious")
    (folder / "folder").mkdir()
    (folder / "folder.py").mkdir()
    (folder / "scenes.py").write_text(SCENES)
    (folder / "broken.py").write_text("import jaxsph\nx = 1 / 0\n")
    (folder / "wrong.py").write_text("def (:\n")
    (folder / "sweep.toml").write_text('command = "sweep"\nscene = "taylor-green"\n')
    (folder / "table.toml").write_text("[scene]\nname = 1\n")
    (folder / "stops.py").write_text("import sys\nsys.exit(4)\n")
    (folder / "set.toml").write_text('scene = "taylor-green"\nset = 5\n')
    (folder / "flag.toml").write_text('scene = "taylor-green"\noverwrite = "yes"\n')
    (folder / "colours.toml").write_text("colours = [1, 2]\n")
    for name in ("picture.png", "plain.html"):
        (folder / name).write_text("text")
    (folder / "unknown.toml").write_text('scene = "taylor-green"\ncolour = 3\n')
    random_run(folder / "t.h5", count=3)

    def make(reynolds):
        return jaxsph.scenes.taylor_green(12, reynolds, end_time=0.04, arrangement=Lattice())

    trained = jaxsph_rom.train(make, [{"reynolds": 100.0}, {"reynolds": 200.0}], modes=2)
    trained.save(folder / "model.h5")
    return folder


def listing(folder: Path) -> dict[Path, int]:
    """All files and when they were last written."""
    found = (path for path in folder.rglob("*") if "__pycache__" not in path.parts)
    return {path: path.stat().st_mtime_ns if path.is_file() else 0 for path in found}


@pytest.mark.parametrize("program, line, message", ALL, ids=[f"{p} {line}" for p, line, _ in ALL])
def test_one_line_and_code_2(folder, monkeypatch, capfd, program, line, message):
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, "path", list(sys.path))
    before = listing(folder)
    assert main(program, line.split()) == 2
    told = capfd.readouterr()
    assert told.err.startswith(f"{program}: error: ") and told.err.count("\n") == 1, told.err
    assert message in told.err and told.out == ""
    assert len(told.err) < 600
    assert listing(folder) == before


def test_there_are_cases_of_every_command():
    from jaxsph_command.commands import COMMANDS

    assert len(ALL) >= 60
    for program, commands in COMMANDS.items():
        lines = [line for of, line, _ in ALL if of == program]
        for name in commands:
            assert sum(line.split()[:1] == [name] for line in lines) >= 3, (program, name)


@pytest.mark.parametrize(
    "program, line",
    [
        ("jaxsph", "run taylor-grene"),
        ("jaxsph", f"{RUN} --h-over-dx 0.1"),
        ("jaxsph-rom", "predict text --reynolds 100"),
    ],
)
def test_the_same_of_a_process_of_its_own(folder, program, line):
    before = listing(folder)
    done = subprocess.run(
        [sys.executable, "-m", program.replace("-", "_"), *line.split()],
        env={**os.environ, "PYTHONPATH": str(Path(jaxsph.__file__).parents[1])},
        cwd=folder, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.startswith(f"{program}: error: ") and done.stderr.count("\n") == 1
    assert listing(folder) == before
