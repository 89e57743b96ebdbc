"""`jaxsph-rom suggest FILE`: where the next full run is worth most."""

from __future__ import annotations

import json
from pathlib import Path

import jax
import numpy as np

from jaxsph.cli import Parser, print_rows
from jaxsph.io import check_target

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
    parser.add_argument("--json", type=Path, metavar="FILE", help="write it to FILE as well")


def _suggest(options) -> int:
    if options.json is not None:
        check_target(options.json)
    with jax.enable_x64(True):
        trained = load(options.model)
    with jax.enable_x64(trained.flow.reference.points.dtype == np.float64):
        point = trained.suggest()
        expected = float(trained.predict(point).error_indicator[0])
    if options.json is not None:
        results = {"parameters": point, "error_indicator": expected}
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps(results, indent=2) + "\n")
    print_rows({
        "train next at": said(point),
        "expected error": f"{100.0 * expected:.2g} % of velocity there",
    })  # fmt: skip
    return 0
