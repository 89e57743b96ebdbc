"""A film holds places and values of a run, to the digits that a picture has."""

import base64
import json
import re
import shutil
import subprocess

import numpy as np
import pytest
import yaml

from jaxsph.io import read_trajectory
from jaxsph.plotting import FIELDS
from jaxsph.report import film as film_module
from jaxsph.report.film import film
from jaxsph.report.film_script import SCRIPT
from jaxsph.report.settings import CITATION
from tests.docs.test_pages import ROOT
from tests.runs import random_run


def told(piece):
    return json.loads(re.search(r"\(document.currentScript, (.*)\)</script>", piece, re.DOTALL)[1])


def read(text, kind):
    return np.frombuffer(base64.b64decode(text), kind)


@pytest.mark.parametrize("dim", [2, 3])
def test_it_holds_the_run(tmp_path, dim):
    run = read_trajectory(random_run(tmp_path / "t.h5", count=4, dim=dim))
    found = told(film(tmp_path / "t.h5"))
    np.testing.assert_allclose(found["times"], run.time)
    if dim == 3:  # one layer of sixteen
        assert all(200 < count < 400 for count in found["counts"])
        return
    counts, around = found["counts"], found["around"]
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])  # images come behind the particles
    own = (starts[:, None] + np.arange(256)).ravel()
    share = read(found["places"], "<u2").reshape(-1, 2)[own] / 65535.0
    places = ((1.0 + 2.0 * around) * share - around).reshape(4, 256, 2) * found["extent"]
    moved = places - places[0, 0], run.position - run.position[0, 0]
    np.testing.assert_allclose(*moved, atol=1e-4)
    for field, kept in zip(FIELDS.values(), found["fields"], strict=True):
        index = read(kept["values"], np.uint8)[own].reshape(4, 256)
        value = field.value(run)
        share = (value - kept["low"]) / (kept["high"] - kept["low"])
        np.testing.assert_allclose(index, np.clip(254.0 * share, 0, 254), atol=1.001)
        assert len(kept["colours"]) == 256 and field.name in kept["label"]
        assert (index > 0).any() and (index < 254).any()


def test_a_long_run_has_fewer_times_and_what_is_no_number_is_grey(tmp_path, monkeypatch):
    path = random_run(tmp_path / "t.h5", count=5)
    monkeypatch.setattr(film_module, "_BYTES", 3 * 256 * 8)  # three frames
    assert len(told(film(path))["times"]) == 3
    values = [np.array([np.nan, 0.0, 1.0], np.float32)]
    kept = film_module._field(FIELDS["density"], values)
    assert read(kept["values"], np.uint8)[0] == 255 and kept["colours"][255] == "#d9d9d9"


@pytest.mark.skipif(shutil.which("node") is None, reason="no node here")
def test_the_script_is_one():
    checked = subprocess.run(["node", "--check", "-"], input=f"({SCRIPT})", text=True,
                             capture_output=True)  # fmt: skip
    assert checked.returncode == 0, checked.stderr


def test_what_is_to_be_cited_is_what_the_file_says():
    told = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    paper = told["references"][0]
    for text in (told["version"], told["title"].partition(": ")[2], paper["title"],
                 paper["identifiers"][0]["value"], str(paper["year"]),
                 paper["authors"][0]["family-names"]):  # fmt: skip
        assert text in CITATION
