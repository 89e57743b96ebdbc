"""What the commands of benchmarks share: their frame, and a table that is kept as it grows."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import jax

from jaxsph import SimulationError
from jaxsph.cli import Parser, fail, report_errors
from jaxsph.io import check_target

from .measure import read_json, tell, write_json


def command(
    name: str,
    about: str,
    arguments: Callable[[Callable], None],
    run: Callable[[argparse.Namespace], int | None],
    argv: list[str] | None,
    json: str | None = "",
) -> int:
    """Run `python -m benchmarks.NAME` in double precision; its exit code.

    Args:
        name: of the benchmark.
        about: its docstring, whose first line the help shows.
        arguments: is given `add_argument`; `--json` need not be among them.
        run: what the command does, given its options, `options.json` among them; an exit code, or
            None for 0. A full model that is lost in it gives 1.
        argv: of the command line.
        json: where results go unless `--json` says otherwise, {option} standing for an option's
            value; `NAME.json` if it is not given, nowhere for None.
    """
    where = "" if json is None else f"benchmarks/results/{json or name + '.json'}"
    shown = re.sub(r"{(\w+)}", lambda option: option[1].upper(), where)
    program = f"python -m benchmarks.{name}"
    parser = Parser(program, description=about.partition("\n")[0])
    arguments(parser.add_argument)
    shown = f"results (default: {shown or 'none'})"
    parser.add_argument("--json", type=Path, metavar="FILE", help=shown)

    def parsed() -> int:
        options = parser.parse_args(argv)
        values = {key: str(value).replace("-", "_") for key, value in vars(options).items()}
        options.json = options.json or (Path(where.format_map(values)) if where else None)
        if options.json is not None:
            check_target(options.json)
        try:
            with jax.enable_x64(True):
                return int(run(options) or 0)
        except SimulationError as error:
            return fail(name, f"full model: {error}", 1)

    return report_errors(name, parsed)


class Table:
    """Rows in a JSON file that is written after each: the same command goes on where it was cut.

    Args:
        path: of the file.
        key: names of what tells one row from another.
        settings: that all rows share.
        beside: makes what else the file holds from the rows, each time that it is written.
        rows: the name under which the file has them.

    Raises:
        ValueError: if the file holds results of another kind, or of other settings.
    """

    def __init__(
        self,
        path: Path,
        key: Iterable[str] = (),
        settings: Mapping[str, Any] | None = None,
        beside: Callable[[list[dict[str, Any]]], Mapping[str, Any]] = lambda rows: {},
        rows: str = "rows",
    ):
        fresh = {} if settings is None else {"settings": dict(settings)}
        self.path, self.key, self._beside = path, tuple(key), beside
        self.results: dict[str, Any] = read_json(path) or fresh
        if self.results.get("settings") != fresh.get("settings"):
            raise ValueError(
                f"{path}: was made with other settings; name another file with --json."
            )
        self.rows: list[dict[str, Any]] = self.results.setdefault(rows, [])
        if any(name not in row for row in self.rows for name in self.key):
            raise ValueError(f"{path}: holds other results; name another file.")

    def has(self, case: Mapping[str, Any] | tuple) -> bool:
        """Whether a row of these values is there; a tuple holds those of the key."""
        case = dict(case if isinstance(case, Mapping) else zip(self.key, case, strict=True))
        return any(all(row.get(k) == v for k, v in case.items()) for row in self.rows)

    def left(self, cases: Iterable[Mapping[str, Any]]) -> Iterator[Mapping[str, Any]]:
        """The cases that have no row yet, each told of."""
        for case in cases:
            name = ", ".join(f"{key} {value}" for key, value in case.items())
            done = self.has(case)
            tell(f"done before: {name}" if done else name)
            if not done:
                yield case

    def add(self, row: Mapping[str, Any]) -> None:
        """One row more, in the file at once."""
        self.rows.append(dict(row))
        self.write()

    def write(self) -> None:
        """The file as the table is now."""
        self.results |= self._beside(self.rows)
        write_json(self.path, self.results)
