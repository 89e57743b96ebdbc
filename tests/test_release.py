"""The distributions hold what they should, and the main job runs from an installed wheel."""

import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

import jaxsph

ROOT = Path(__file__).parents[1]
PACKAGES = ("jaxsph", "jaxsph_rom", "jaxsph_command")
FOLDERS = (*PACKAGES, "benchmarks", "docs", "notebooks", "tests", ".ci")
MAIN_JOB = (
    "run taylor-green --resolution 16 --t-end 0.06 --arrangement lattice "
    "--train 100 200 --predict 150 --modes 2 --out out"
)


def run(*command, cwd, **variables) -> str:
    """What a command prints; it sees nothing of this checkout."""
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        env=kept | variables,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The wheel, made from the source distribution, and that itself; built from a copy."""
    folder, copy = tmp_path_factory.mktemp("dist"), tmp_path_factory.mktemp("copy")
    for path in ROOT.iterdir():
        if path.name in FOLDERS:
            shutil.copytree(path, copy / path.name, ignore=shutil.ignore_patterns("__pycache__"))
        elif path.is_file():
            shutil.copy(path, copy)
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, copy, cwd=folder)
    (wheel,), (source,) = folder.glob("*.whl"), folder.glob("*.tar.gz")
    return wheel, source


def test_the_version_stands_in_one_place(built):
    cited = re.search(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)
    assert cited[1] == jaxsph.__version__
    assert all(path.name.startswith(f"jaxsph-{jaxsph.__version__}") for path in built)


def test_the_wheel_holds_the_packages_and_their_data(built):
    names = set(zipfile.ZipFile(built[0]).namelist())
    data = {"jaxsph/py.typed", "jaxsph_rom/py.typed", "jaxsph_rom/advice/work_precision.json"}
    modules = {
        path.relative_to(ROOT).as_posix()
        for top in PACKAGES
        for path in (ROOT / top).rglob("*.py")
    }
    assert names >= data | modules
    metadata = f"jaxsph-{jaxsph.__version__}.dist-info"
    tops = {*PACKAGES, metadata}
    assert {name.partition("/")[0] for name in names} == tops
    assert f"{metadata}/licenses/LICENSE" in names


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="no checkout to compare with")
def test_the_source_distribution_is_the_repository(built):
    tracked = run("git", "ls-files", cwd=ROOT).split("\n")[:-1]
    with tarfile.open(built[1]) as archive:
        held = {name.partition("/")[2] for name in archive.getnames()}
    there = {name for name in tracked if (ROOT / name).exists()}
    assert there <= held


def check(folder: Path) -> None:
    """The main job, from a virtual environment in a folder of its own."""
    programs = folder / "venv" / ("Scripts" if os.name == "nt" else "bin")
    where = run(programs / "python", "-c", "import jaxsph; print(jaxsph.__file__)", cwd=folder)
    assert Path(where.strip()).is_relative_to(folder)
    assert run(programs / "jaxsph", "--version", cwd=folder).split()[-1] == jaxsph.__version__
    assert "taylor-green" in run(programs / "jaxsph", "scenes", cwd=folder)
    assert "150" in run(programs / "jaxsph-rom", *MAIN_JOB.split(), cwd=folder)
    assert json.loads((folder / "out" / "report.json").read_text())["cases"][0]["stable"]
    advice = ("advise", "taylor-green", "--velocity-error", "1%")
    assert "jaxsph" in run(programs / "jaxsph-rom", *advice, cwd=folder)


def test_the_main_job_runs_from_the_wheel(built, tmp_path):
    """The dependencies are borrowed from this environment, the packages are not."""
    run(sys.executable, "-m", "venv", tmp_path / "venv", cwd=tmp_path)
    python = tmp_path / "venv" / ("Scripts" if os.name == "nt" else "bin") / "python"
    own = run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=tmp_path)
    borrowed = [path for path in sys.path if Path(path).name in ("site-packages", "dist-packages")]
    Path(own.strip(), "borrowed.pth").write_text("\n".join(borrowed) + "\n")
    run(python, "-m", "pip", "install", "--no-deps", "--no-index", built[0], cwd=tmp_path)
    check(tmp_path)


@pytest.mark.slow
def test_the_main_job_runs_from_the_wheel_in_a_fresh_environment(built, tmp_path):
    """With its own dependencies, as a user gets them; needs a package index."""
    run(sys.executable, "-m", "venv", tmp_path / "venv", cwd=tmp_path)
    python = tmp_path / "venv" / ("Scripts" if os.name == "nt" else "bin") / "python"
    run(python, "-m", "pip", "install", built[0], cwd=tmp_path)
    check(tmp_path)
