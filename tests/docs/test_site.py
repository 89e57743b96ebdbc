"""The documentation site builds strictly, holds every public name, and fetches nothing."""

import html
import importlib
import inspect
import json
import os
import pkgutil
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import jaxsph
import jaxsph_rom
from jaxsph.scenes import SCENES
from tests.report.test_browser import BROWSER

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    done = subprocess.run(
        command,
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT), "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return folder


def packages():
    for top in (jaxsph, jaxsph_rom):
        yield top.__name__
        for found in pkgutil.walk_packages(top.__path__, f"{top.__name__}."):
            if found.ispkg:
                yield found.name


def test_every_public_name_has_its_place(site):
    missing = []
    for package in packages():
        page = site / "reference" / f"{package}.html"
        text = page.read_text() if page.exists() else ""
        for name, thing in vars(importlib.import_module(package)).items():
            public = not name.startswith("_") and not isinstance(thing, ModuleType)
            entry = rf">\s*{re.escape(package)}\.{name}\s*<"  # a heading, or a link to one
            if public and not re.search(entry, text):
                missing.append(f"{package}.{name}")
    assert not missing


def test_a_public_class_shows_its_arguments_and_where_it_is(site):
    text = html.unescape(re.sub(r"<[^>]+>", "", (site / "reference/jaxsph.html").read_text()))
    assert re.search(r"Fluid\(\s*reference_density,\s*sound_speed,\s*reference_speed", text)
    assert "Source code in jaxsph/fluid.py" in text


def test_effects_kernels_and_projections_have_their_equations():
    """Beside the code: a page of equations has the module in a box."""
    pages = "".join(page.read_text() for page in (ROOT / "docs/equations").glob("*.md"))
    boxes = set(re.findall(r"^@computed (\S+)$", pages, re.MULTILINE))
    wanted = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts)
        for folder in ("jaxsph/effects", "jaxsph/kernels", "jaxsph_rom/projection")
        for path in (ROOT / folder).glob("*.py")
        if path.stem not in ("__init__", "base", "spectral_radius")
    }
    assert wanted <= boxes


def test_equations_are_shown_without_a_script(site):
    for page in site.rglob("*.html"):
        assert "arithmatex" not in page.read_text(), page.name  # each became MathML
    assert (site / "equations/delta_plus.html").read_text().count("<math") > 10


def test_nothing_is_fetched_while_reading(site):
    loads = re.compile(r'<(?:script|img|iframe|link rel="(?:stylesheet|preconnect|icon)")[^>]*//')
    for page in site.rglob("*.html"):
        assert not loads.search(page.read_text()), page.name


def test_every_scene_has_its_page(site):
    index = (site / "scenes/index.html").read_text()
    measured = 0
    for name, make in SCENES.items():
        text = (site / f"scenes/{name}.html").read_text()
        plain = html.unescape(re.sub(r"<[^>]+>", "", text))
        assert f'href="{name}.html"' in index
        assert make.__doc__.partition("\n")[0].replace("`", "").rstrip(":.") in plain
        assert f"jaxsph run {name}" in plain
        options = set(re.findall(r"<td><code>(--[a-z0-9-]+)", text))
        own = inspect.signature(make).parameters.keys() - {"dtype", "end_time"}
        assert options >= {"--t-end", *("--" + key.replace("_", "-") for key in own)}
        for figure in re.findall(r'src="(\.\./figures/[\w.-]+)"', text):
            assert (site / "scenes" / figure).exists()
        measured += f"measured_{name}.png" in text
    assert measured >= 14


def test_every_notebook_has_its_page(site):
    index = (site / "notebooks/index.html").read_text()
    for notebook in (ROOT / "notebooks").glob("*.ipynb"):
        assert f'href="{notebook.stem}.html"' in index
        page = html.unescape((site / f"notebooks/{notebook.stem}.html").read_text())
        shown = [f"notebooks/{name}" for name in re.findall(r'src="([\w]+\.png)"', page)]
        assert len(shown) == notebook.read_text().count('"image/png"') > 0
        assert all((site / name).read_bytes().startswith(b"\x89PNG") for name in shown)


def test_search_is_there_when_a_page_is_opened_from_a_folder(site):
    for page in ("index.html", "scenes/dam-break.html"):
        assert "js/iframe-worker.js" in (site / page).read_text()  # workers need a server else
    stored = (site / "search/search_index.js").read_text()
    assert stored.startswith("var __index = {") and len(stored) > 1e5


@pytest.mark.skipif(shutil.which("node") is None, reason="no node here")
def test_search_finds(site):
    command = ["node", str(ROOT / "tests/docs/search.js"), str(site)]
    command += ["dam break", "stability limit", "qqzzqq"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    break_, limit, nothing = map(json.loads, done.stdout.splitlines())
    assert any(place.startswith("scenes/dam-break.html") for place in break_)
    assert any(place.startswith("faq.html") for place in limit)
    assert nothing == []


@pytest.mark.skipif(BROWSER is None, reason="no browser here")
def test_a_browser_searches_a_folder(site, tmp_path):
    command = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu",
               f"--user-data-dir={tmp_path / 'profile'}", "--host-resolver-rules=MAP * ~NOTFOUND",
               "--virtual-time-budget=20000", "--dump-dom",
               f"{(site / 'index.html').as_uri()}?q=viscosity"]  # fmt: skip
    shown = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
    assert int(re.search(r"(\d+) matching documents", shown)[1]) > 10
    assert "equations/consistent.html" in shown


def test_every_table_and_figure_of_a_page_is_on_the_site(site):
    for source in (ROOT / "docs/measured").glob("*.md"):
        text, page = source.read_text(), (site / f"measured/{source.stem}.html").read_text()
        assert page.count("<table>") == len(re.findall(r"^\|[ -]*---[-| ]*$", text, re.MULTILINE))
        figures = re.findall(r"\(\.\./(figures/\w+\.png)\)", text)
        assert all(f'src="../{figure}"' in page for figure in figures)


def test_the_readme_is_short():
    assert len((ROOT / "README.md").read_text().splitlines()) <= 150


def test_a_section_that_is_gone_breaks_the_build(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs/hooks")
    section = importlib.import_module("include").section
    text = "# Title\nstart\n## One\nfirst\n### Inside\n## Two\nsecond\n"
    assert section(text, "(start)") == "start\n"
    assert section(text, "One") == "first\n## Inside\n"
    with pytest.raises(KeyError):
        section(text, "Three")


def test_the_readme_says_how_it_is_built():
    assert "python -m mkdocs build --strict" in (ROOT / "README.md").read_text()
