"""What a browser without a screen, and without a network, makes of a report."""

import re
import shutil
import subprocess

import pytest

from jaxsph.cli import main

BROWSER = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
PROBE = """<script>onload = () => { document.title = [...document.images].map(
    image => image.naturalWidth).join() + ";" + document.querySelectorAll("td").length + ";" +
    (document.documentElement.scrollWidth <= innerWidth) }</script>"""


@pytest.mark.skipif(BROWSER is None, reason="no browser here")
def test_a_browser_shows_all_of_it(tmp_path):
    run = [
        "run",
        "taylor-green",
        "--resolution",
        "12",
        "--t-end",
        "0.05",
        "--arrangement",
        "lattice",
    ]
    assert main([*run, "--out", str(tmp_path / "run")]) == 0
    source = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    probed = tmp_path / "probed.html"
    probed.write_text(source.replace("</body>", f"{PROBE}</body>"), encoding="utf-8")
    command = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--window-size=1200,900",
               f"--user-data-dir={tmp_path / 'profile'}", "--host-resolver-rules=MAP * ~NOTFOUND",
               "--virtual-time-budget=5000", "--dump-dom", probed.as_uri()]  # fmt: skip
    shown = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
    widths, cells, fits = re.search("<title>(.*?)</title>", shown)[1].split(";")
    assert len(widths.split(",")) == source.count("<img") == 2
    assert all(int(width) > 300 for width in widths.split(","))  # decoded, none broken
    assert int(cells) == source.count("<td") > 20
    assert fits == "true"  # nothing runs out of the window
