"""Environments for the peers, outside of this repository: `python -m benchmarks.peers.setup`.

    git clone JAX-SPH'S REPOSITORY FOLDER/jax-sph          (github: tumaer/jax-sph)
    python -m benchmarks.peers.setup FOLDER --jax-sph FOLDER/jax-sph

makes FOLDER/pysph and, given JAX-SPH's sources, FOLDER/jax-sph-env, and says with which options
`python -m benchmarks.peers` finds them. PySPH is compiled on the way (gcc with OpenMP; five minutes
on two cores).
"""

from __future__ import annotations

import subprocess
import sys
import venv
from pathlib import Path

from jaxsph.cli import Parser, report_errors

from ..measure import tell

# each line by itself: what builds a package must be there before it
PYSPH = (
    ("setuptools<70", "wheel", "cython<3.1", "numpy<2", "mako"),
    ("numpy<2", "cyarray", "pytools", "beaker"),
    ("numpy<2", "compyle"),
    ("numpy<2", "pysph==1.0b2"),
)
JAX_SPH = (  # jax as in JAX-SPH's own lock file for Python 3.11
    ("jax[cpu]==0.7.1", "numpy<2.3", "scipy", "omegaconf", "jraph", "absl-py", "h5py", "pandas"),
    ("pyvista",),
)


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input or a failed installation."""
    return report_errors("setup", _command, argv)


def _command(argv) -> int:
    parser = Parser("python -m benchmarks.peers.setup", description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="where the environments are made")
    parser.add_argument("--jax-sph", type=Path, metavar="PATH", help="folder of its sources")
    options = parser.parse_args(argv)
    root = Path(__file__).resolve().parents[2]
    if options.folder.resolve().is_relative_to(root):
        raise ValueError(f"folder: {options.folder} is in this repository; choose another place.")
    found = ["--pysph-python", str(make(options.folder / "pysph", PYSPH, isolated=False))]
    if options.jax_sph is not None:
        python = make(options.folder / "jax-sph-env", JAX_SPH, isolated=True)
        found += ["--jax-sph", str(options.jax_sph), "--jax-sph-python", str(python)]
    print(" ".join(found))
    return 0


def make(folder: Path, lines: tuple[tuple[str, ...], ...], *, isolated: bool) -> Path:
    """An environment with packages from the package index; its Python.

    Args:
        folder: of the environment.
        lines: of packages, installed one line after the other.
        isolated: whether packages are built away from what is installed, pip's default.

    Raises:
        ValueError: if pip fails.
    """
    venv.create(folder, with_pip=True)
    python = folder / ("Scripts" if sys.platform == "win32" else "bin") / "python"
    options = () if isolated else ("--no-build-isolation",)
    for line in lines:
        tell(f"{folder.name}: {' '.join(line)}")
        command = [str(python), "-m", "pip", "install", "--quiet", *options, *line]
        if subprocess.run(command).returncode != 0:
            raise ValueError(f"pip could not install {' '.join(line)}; its messages are above.")
    return python


if __name__ == "__main__":
    raise SystemExit(main())
