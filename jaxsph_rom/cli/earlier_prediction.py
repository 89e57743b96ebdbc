"""Files of a prediction, of a model on points or on labels, and what an earlier one left."""

from __future__ import annotations

import re
from pathlib import Path

PREDICTION = "prediction.h5"
MEMBER = "member-{:03d}.h5"
MOST_FILES = 100  # of members
_ON_LABELS = re.compile(r"member-\d{3}\.(h5|vtkhdf)")
_ON_POINTS = re.compile(r"(member-\d{3}|re-[-+.e\d]+)\.(h5|vtkhdf)")
_FOLDERS = {"": _ON_LABELS, "fields": _ON_POINTS, "tracers": _ON_POINTS}
_REPORTS = ("report.html", "report.json")


def remove_earlier(folder: Path) -> None:
    """Take away what an earlier prediction left, which would stand beside this one's; its
    coordinates stay until others are there to replace them."""
    for name in _REPORTS:
        (folder / name).unlink(missing_ok=True)
    for name, member in _FOLDERS.items():
        within = folder / name
        for file in within.iterdir() if within.is_dir() else ():
            if member.fullmatch(file.name):
                file.unlink()
        if name and within.is_dir() and not any(within.iterdir()):
            within.rmdir()
