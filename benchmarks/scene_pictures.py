"""Pictures of scenes for their pages: `docs/figures/scene_NAME.png`.

    python -m benchmarks.scene_pictures [SCENE ...]

Each scene is run at a size at which its flow is seen, seconds to a minute, and its last velocity
drawn, with the walls.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from jaxsph.cli import main as jaxsph
from jaxsph.io import read_box, read_snapshot, read_walls_of
from jaxsph.plotting import FIELDS, snapshot_figure

FIGURES = Path(__file__).parents[1] / "docs" / "figures"
_DPI = 90
_FIELDS = {"hydrostatic-tank": "pressure", "cylinder": "vorticity"}
# what each is run with; the dam break has a moving picture of its own
OPTIONS = {
    "taylor-green": "--resolution 40 --t-end 0.4",
    "taylor-green-3d": "--resolution 16 --h-over-dx 1.5 --t-end 0.2",
    "lid-driven-cavity": "--resolution 32 --reynolds 100 --t-end 4",
    "couette": "--resolution 20 --t-end 1",
    "poiseuille": "--resolution 20 --t-end 1",
    "hydrostatic-tank": "--resolution 25 --t-end 0.5",
    "elliptic-drop": "--resolution 40",
    "gresho-vortex": "--resolution 48",
    "oscillating-drop": "--resolution 40",
    "rotating-square-patch": "--resolution 40",
    "shear-layer": "--resolution 48",
    "standing-wave": "--resolution 60 --t-end 0.3",
    "poiseuille-open": "--resolution 20 --t-end 1",
    "sloshing": "--t-end 3",
    "piston-wave-maker": "--t-end 2.4",
    "filling-tank": "--t-end 2",
    "floating-box": "--lift 0.08 --t-end 0.6",
    "taylor-couette": "--resolution 16 --t-end 0.5",
    "open-cavity": "--resolution 40 --t-end 0.5",
    "channel-cylinder": "--resolution 33 --t-end 2",
    "backward-facing-step": "--t-end 20",
    "dam-break-3d": "--t-end 0.7",
    "cylinder": "--resolution 10 --width 6 --upstream 4 --downstream 6 --t-end 60",
}


def main(argv: list[str] | None = None) -> int:
    """Exit code 0: good, 1: a run failed."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("scenes", nargs="*", choices=[*OPTIONS, []], metavar="SCENE",
                        help=f"of {', '.join(OPTIONS)} (default: all)")  # fmt: skip
    failed = 0
    for name in parser.parse_args(argv).scenes or OPTIONS:
        with tempfile.TemporaryDirectory() as folder:
            failed |= jaxsph(["run", name, *OPTIONS[name].split(), "--out", folder])
            if failed:
                break
            draw(name, Path(folder) / "trajectory.h5")
    return failed


def draw(name: str, trajectory: Path) -> None:
    """The picture of a run."""
    field = FIELDS[_FIELDS.get(name, "velocity")]
    time, snapshot = read_snapshot(trajectory)
    figure = snapshot_figure(time, snapshot, (field,), read_walls_of(trajectory, snapshot),
                             read_box(trajectory))  # fmt: skip
    figure.savefig(FIGURES / f"scene_{name.replace('-', '_')}.png", dpi=_DPI, facecolor="white")


if __name__ == "__main__":
    raise SystemExit(main())
