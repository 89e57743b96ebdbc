"""What programs for an H200 would do, compiled without one: kernels, memory, registers.

    python -m pip install --target CUDA "jax[cuda12]==VERSION"
    python -m benchmarks.ahead_of_time --cuda CUDA

Needs the CUDA wheels of the same version of JAX in a folder of their own. Nothing runs on a GPU.
Of right-hand side, gradient, list and a step of a vortex: operations that a GPU is told to start
(loops times their turns, the longer branch of two), waits of the host, temporary bytes, and the
most registers and spilled bytes of a kernel. `chunks` are the pair sums as a CPU has them.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import time as clock
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
from jax.experimental import topologies
from jax.interpreters import mlir
from jax.sharding import SingleDeviceSharding

from jaxsph import pair_sum_on_gpu
from jaxsph.arrangements import Lattice
from jaxsph.cli import positive_int
from jaxsph.environment import versions
from jaxsph.integrate import integrate
from jaxsph.pair_sum_over_devices import lowered
from jaxsph.pairs import _one_by_one, pair_sum_p
from jaxsph.scenes import taylor_green, taylor_green_3d

from .measure import format_rows, write_json
from .table import command

LOWERINGS = {
    "chunks": lowered(pair_sum_p, mlir.lower_fun(_one_by_one)),
    "tiles": lowered(pair_sum_p, pair_sum_on_gpu.lower),
}
_TARGET = Path(__file__).parent / "h200.txtpb"
_FREE = {  # nothing to start
    "parameter", "constant", "get-tuple-element", "tuple", "bitcast", "after-all", "iota",
    "partition-id", "copy-done", "async-done",
}  # fmt: skip


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 2: bad input."""
    return command("ahead_of_time", __doc__, _arguments, _run, argv)


def _arguments(add) -> None:
    add("--cuda", type=Path, required=True, metavar="FOLDER", help="where the CUDA wheels are")
    add("--sides", type=positive_int, nargs="+", default=[316, 1000], metavar="N",
        help="particles per side in two dimensions (default: 316 1000)")  # fmt: skip
    add("--sides-3d", type=positive_int, nargs="*", default=[46, 100], metavar="N",
        help="in three (default: 46 100)")  # fmt: skip
    add("--lowerings", nargs="+", default=list(LOWERINGS), choices=list(LOWERINGS),
        help="how pair sums are lowered (default: both)")  # fmt: skip


def _run(options) -> None:
    if not (options.cuda / "jax_plugins").is_dir():
        raise ValueError(
            f"--cuda: no jax_plugins in {options.cuda.name}; install jax[cuda12] of version "
            f"{jax.__version__} there, by pip install --target."
        )
    jax.config.update("jax_platforms", "cpu")
    sys.path.append(str(options.cuda))
    target = _Target(options.cuda)
    rows = []
    for make, h_over_dx, sides in (
        (taylor_green, 2.0, options.sides),
        (taylor_green_3d, 1.3, options.sides_3d),
    ):
        for side in sides:
            scene = make(side, 1e6, arrangement=Lattice(), dtype="float32", h_over_dx=h_over_dx)
            rows += _rows(scene, options.lowerings, target)
    write_json(options.json, {"rows": rows, "compiled_for": target.name, "versions": versions()})
    print(format_rows(list(rows[0]), [[str(v) for v in row.values()] for row in rows]))


def _rows(scene, lowerings, target) -> list[dict[str, Any]]:
    """Of each program of a scene."""
    model, state = scene.model(), scene.state
    lists = jax.eval_shape(model.search.build, state.position)
    time = jnp.zeros((), state.density.dtype)

    def energy(state, lists):
        rates = model.rates(time, state, lists)
        return sum(jnp.sum(rate * rate) for rate in jax.tree.leaves(rates))

    def step(state):
        zero = jnp.zeros((), jnp.int32)
        return integrate(model, state, zero, jnp.asarray(scene.time_step, time.dtype), 2, 1)

    programs = {
        "right-hand side": (lambda s, n: model.rates(time, s, n), state, lists),
        "gradient": (jax.grad(energy), state, lists),
        "list": (model.search.build, state.position),
        "interval": (step, state),
    }
    rows = []
    for lowering in lowerings:
        mlir.register_lowering(pair_sum_p, LOWERINGS[lowering], platform="cuda")
        for name, (function, *arguments) in programs.items():
            found = target.compiled(lambda *a, function=function: function(*a), *arguments)
            case = {"dim": scene.space.box.dim, "particles": len(state.density)}
            rows.append(case | {"lowering": lowering, "program": name} | found)
            print(rows[-1], file=sys.stderr, flush=True)
    return rows


class _Target:
    """An H200 by its description."""

    def __init__(self, wheels: Path):
        jax.devices()
        self.assembler = next(wheels.glob("nvidia/**/bin/ptxas"), None)
        topology = topologies.get_topology_desc(
            platform="cuda", topology_name="", target_config=_TARGET.read_text(), topology="1x1x1"
        )
        self.name = topology.devices[0].device_kind
        self.where = SingleDeviceSharding(topology.devices[0])

    def compiled(self, function: Callable, *arguments) -> dict[str, Any]:
        start = clock.perf_counter()
        shapes = jax.tree.map(
            lambda a: jax.ShapeDtypeStruct(a.shape, a.dtype, sharding=self.where), arguments
        )
        with tempfile.TemporaryDirectory() as folder:
            lowered = jax.jit(function).trace(*shapes).lower()
            program = lowered.compile(compiler_options={"xla_dump_to": folder})
            registers, spilled = self._registers(Path(folder))
        operations, waits = counted(program.as_text())
        return {
            "operations": operations,
            "waits": waits,
            "temporary_bytes": program.memory_analysis().temp_size_in_bytes,
            "registers": registers,
            "spilled_bytes": spilled,
            "compile_seconds": round(clock.perf_counter() - start, 1),
        }

    def _registers(self, folder: Path) -> tuple[int | None, int | None]:
        """The most of a kernel, and spilled bytes of all that can be assembled one by one."""
        if self.assembler is None:
            return None, None
        told = ""
        for source in folder.glob("*.ptx"):
            command = [self.assembler, "-v", "-arch", "sm_90a", source, "-o", folder / "kernel"]
            told += subprocess.run(command, capture_output=True, text=True, check=False).stderr
        most = max(map(int, re.findall(r"Used (\d+) registers", told)), default=0)
        return most, sum(map(int, re.findall(r"(\d+) bytes spill stores", told)))


def counted(text: str) -> tuple[int, int]:
    """Operations to start in a compiled program's text, and waits of the host for a number."""
    bodies: dict[str, list[str]] = {}
    for line in text.splitlines():
        header = re.match(r"(ENTRY )?%?([\w.\-]+) \(.*\{$", line)
        if header:
            name = "ENTRY" if header[1] else header[2]
            bodies[name] = []
        elif line.startswith("  ") and bodies:
            bodies[name].append(line)

    def of(name: str) -> tuple[int, int]:
        operations = waits = 0
        for line in bodies[name]:
            kind = re.search(r"[\]})] ([a-z][\w\-]*)\(", line)
            if kind is None or kind[1] in _FREE:
                continue
            called = {
                key: re.findall(r"[\w.\-]+", names)
                for key, names in re.findall(
                    r"(body|to_apply|branch_computations|true_computation|false_computation)"
                    r"=\{?((?:%[\w.\-]+(?:, )?)+)", line,
                )
            }  # fmt: skip
            if kind[1] == "while":
                turns = re.search(r'known_trip_count":\{"n":"(\d+)"', line)
                more, each = of(called["body"][0])
                turns, waits = (int(turns[1]), waits) if turns else (1, waits + 1)
                operations, waits = operations + turns * more, waits + turns * each
            elif kind[1] == "conditional":
                branches = [of(branch) for names in called.values() for branch in names]
                operations += max(branch[0] for branch in branches)
                waits += 1 + max(branch[1] for branch in branches)
            elif kind[1] == "call":
                more, each = of(called["to_apply"][0])
                operations, waits = operations + more, waits + each
            else:
                operations += 1
        return operations, waits

    return of("ENTRY")


if __name__ == "__main__":
    sys.exit(main())
