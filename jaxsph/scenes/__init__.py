"""Scenes, one a file; `SCENES` lists them by the name that users type."""

from .balanced import balanced as balanced
from .continued import continued as continued
from .couette import couette as couette
from .hydrostatic_tank import hydrostatic_tank as hydrostatic_tank
from .lid_driven_cavity import lid_driven_cavity as lid_driven_cavity
from .open_cavity import open_cavity as open_cavity
from .poiseuille import poiseuille as poiseuille
from .scales import Scale as Scale
from .scene import Scene as Scene
from .taylor_green import taylor_green as taylor_green
from .taylor_green import taylor_green_3d as taylor_green_3d

SCENES = {
    "taylor-green": taylor_green,
    "taylor-green-3d": taylor_green_3d,
    "lid-driven-cavity": lid_driven_cavity,
    "open-cavity": open_cavity,
    "couette": couette,
    "poiseuille": poiseuille,
    "hydrostatic-tank": hydrostatic_tank,
}
