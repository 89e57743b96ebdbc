"""Every code in a process of its own, asked over its pipes."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
OURS, PYSPH, PYSPH_CACHED, JAX_SPH = "jaxsph", "PySPH", "PySPH, cached", "JAX-SPH"


class WorkerError(Exception):
    """A code that failed: which, and what it said."""


@dataclass(frozen=True)
class Code:
    """How a side is started: its Python, the module in this folder, and what is on the path."""

    name: str
    python: str
    module: str
    arguments: tuple[str, ...] = ()
    paths: tuple[Path, ...] = field(default=())

    def environment(self) -> dict[str, str]:
        """This process's, with all cores for OpenMP, and JAX on the processor.

        Idle OpenMP threads sleep: where other work runs, waiting in a loop would slow PySPH down.
        """
        path = os.pathsep.join(map(str, (ROOT, *self.paths)))
        threads = {"OMP_NUM_THREADS": str(cores()), "OMP_WAIT_POLICY": "passive"}
        return {**os.environ, **threads, "PYTHONPATH": path, "JAX_PLATFORMS": "cpu"}


def cores() -> int:
    """Cores this process and its workers may use."""
    if hasattr(os, "sched_getaffinity"):  # not on every system
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def find_codes(
    jax_sph: Path | None, jax_sph_python: Path | None, pysph_python: Path | None
) -> tuple[list[Code], dict[str, str]]:
    """The codes that can be compared, and why others are missing.

    Args:
        jax_sph: folder of JAX-SPH's sources.
        jax_sph_python: the Python that has what they need; this one if none is given.
        pysph_python: the Python that has PySPH.

    Raises:
        ValueError: if a path is given at which there is no such code.
    """
    codes, missing = [Code(OURS, sys.executable, "ours")], {}
    if pysph_python is None:
        missing[PYSPH] = "no --pysph-python was given"
    else:
        python = _python(pysph_python, "--pysph-python", "pysph.solver.solver", ())
        codes.append(Code(PYSPH, python, "pysph_side"))
        codes.append(Code(PYSPH_CACHED, python, "pysph_side", ("cache",)))
    if jax_sph is None:
        missing[JAX_SPH] = "no --jax-sph was given"
    else:
        if not (jax_sph / "jax_sph" / "solver.py").is_file():
            raise ValueError(
                f"--jax-sph: {jax_sph} holds no jax_sph/solver.py; give the folder of "
                "JAX-SPH's sources."
            )
        paths = (jax_sph.resolve(),)
        python = jax_sph_python or Path(sys.executable)
        python = _python(python, "--jax-sph-python", "jax_sph.solver", paths)
        codes.append(Code(JAX_SPH, python, "jax_sph_side", paths=paths))
    return codes, missing


def _python(path: Path, option: str, module: str, paths: tuple[Path, ...]) -> str:
    """The path of a Python that has a module; not resolved, as it may be a link of its folder."""
    if not (path.is_file() and os.access(path, os.X_OK)):
        raise ValueError(f"{option}: {path} is no program; give the Python that has {module}.")
    python = os.path.abspath(path)
    found = subprocess.run(
        [python, "-c", f"import {module}"],
        env=Code("", python, "", paths=paths).environment(),
        capture_output=True,
        text=True,
    )
    if found.returncode != 0:
        said = found.stderr.strip().splitlines() or ["no reason given"]
        raise ValueError(
            f"{option}: {path} cannot import {module} ({said[-1]}); see "
            "`python -m benchmarks.peers.setup --help`."
        )
    return python


class Worker:
    """A running side. What it prints goes to a file, whose last line is told if it dies."""

    def __init__(self, code: Code, log: Path):
        self.name, self._log = code.name, log
        with log.open("w") as errors:
            self._process = subprocess.Popen(
                [code.python, "-m", f"benchmarks.peers.{code.module}", *code.arguments],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
                cwd=log.parent,
                env=code.environment(),
            )

    def ask(self, do: str, **arguments) -> dict[str, Any]:
        """A request and its reply.

        Raises:
            WorkerError: if the code fails or has ended.
        """
        try:
            self._process.stdin.write(json.dumps({"do": do, **arguments}) + "\n")
            self._process.stdin.flush()
            line = self._process.stdout.readline()
        except BrokenPipeError:
            line = ""
        if not line:
            said = self._log.read_text(errors="replace").strip().splitlines() or ["nothing"]
            raise WorkerError(f"{self.name}: its process ended; it last said: {said[-1]}")
        reply = json.loads(line)
        if "error" in reply:
            raise WorkerError(f"{self.name}: {reply['error']}")
        return reply

    def close(self) -> None:
        """End the process."""
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.close()
        try:
            self._process.wait(timeout=10.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process.stdout.close()


@contextlib.contextmanager
def workers(codes: list[Code]):
    """All codes started, and a folder for files passed to and fro; all gone at the end."""
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        started = {}
        for number, code in enumerate(codes):
            started[code.name] = worker = Worker(code, Path(folder, f"{number}.log"))
            stack.callback(worker.close)
        yield started, Path(folder)
