"""`jaxsph-rom suggest FILE`: where the next full run is worth most."""

from __future__ import annotations

from pathlib import Path

import jax
import numpy as np

from jaxsph.cli import Parser, print_rows
from jaxsph.cli.options import add_json_option, write_json
from jaxsph.environment import environment

from ..points import load
from .options import said


def add_to(parser: Parser, words: list[str]) -> None:
    """Add the command's options to its parser."""
    parser.description = (
        "Name the parameters within the training range at which the error that a model "
        "expects of itself is largest."
    )
    parser.set_defaults(command=_suggest)
    parser.add_argument("model", type=Path, metavar="FILE", help="of the model")
    add_json_option(parser)


def _suggest(options) -> int:
    with jax.enable_x64(True):
        trained = load(options.model)
    with jax.enable_x64(trained.flow.reference.points.dtype == np.float64):
        point = trained.suggest()
        expected = float(trained.predict(point).error_indicator[0])
    results = {"parameters": point, "error_indicator": expected}
    write_json(options.json, {**results, **environment()})
    print_rows({
        "train next at": said(point),
        "expected error": f"{100.0 * expected:.2g} % of velocity there",
    })  # fmt: skip
    return 0
