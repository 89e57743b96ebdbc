"""Files of a prediction, of a model on points or on labels, and what an earlier one left."""

from __future__ import annotations

import re
from pathlib import Path

PREDICTION = "prediction.h5"
MEMBER = "member-{:03d}.h5"
MOST_FILES = 100  # of members
_MEMBER = re.compile(r"(member-\d{3}|re-[-+.e\d]+)\.(h5|vtkhdf)")
_FOLDERS = ("", "fields", "tracers")
_OTHERS = (PREDICTION, "report.html", "report.json")


def remove_earlier(folder: Path) -> None:
    """Take away what an earlier prediction left, which would stand beside this one's."""
    for name in _OTHERS:
        (folder / name).unlink(missing_ok=True)
    for name in _FOLDERS:
        within = folder / name
        for file in within.iterdir() if within.is_dir() else ():
            if _MEMBER.fullmatch(file.name):
                file.unlink()
        if name and within.is_dir() and not any(within.iterdir()):
            within.rmdir()
