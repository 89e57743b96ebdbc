"""The page of promises: the tests that it names are there and run as often as it says."""

import re
from pathlib import Path

import pytest

from jaxsph.cli.show_contents import file_format
from jaxsph.io import trajectory_file
from jaxsph.sweeps import sweep_file
from jaxsph_rom.labels import label_model
from jaxsph_rom.points.files import model_file, prediction_file
from jaxsph_rom.report import json_report
from tests.runs import random_run

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "promises.md").read_text()
ROWS = [[cell.strip() for cell in line.split("|")[1:-1]]
        for line in TEXT.splitlines() if line.startswith("| ")]  # fmt: skip
PROMISES = [row for row in ROWS if "`tests/" in row[2]]
VERSIONS = {row[0].strip("`"): row[1:3] for row in ROWS if row[0].startswith("`")}


@pytest.mark.parametrize("row", PROMISES, ids=lambda row: row[0][:50])
def test_a_promise_names_tests_that_run_as_often_as_it_says(row):
    files = [ROOT / name for name in re.findall(r"`(tests/[\w/]+\.py)`", row[2])]
    texts = [file.read_text() for file in files]
    assert texts
    for text in texts:
        assert text.count("\ndef test_") > text.count("\n@pytest.mark.slow")  # some, each change
    assert ("each release" in row[3]) == any("mark.slow" in text for text in texts)


def test_files_are_of_the_versions_that_the_page_says(tmp_path):
    modules = {"trajectory.h5": trajectory_file, "sweep.h5": sweep_file, "model.h5": model_file}
    for name, module in modules.items():
        assert VERSIONS[name] == [module.FORMAT, str(module.SCHEMA_VERSION)]
    assert VERSIONS["model.h5` on labels"] == [str(part) for part in label_model.KIND]
    assert VERSIONS["prediction.h5"] == [str(part) for part in prediction_file.KIND]
    assert VERSIONS["report.json"][1] == str(json_report.SCHEMA_VERSION)
    assert file_format(random_run(tmp_path / "t.h5", count=2)) == VERSIONS["trajectory.h5"][0]


def test_the_number_of_wrong_command_lines_is_that_of_the_table():
    from tests.cli.test_bad_input import ALL

    (told,) = (int(n) for n in re.findall(r"over (\d+) wrong lines", TEXT))
    assert len(ALL) > told
