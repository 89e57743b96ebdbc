"""Scenes, one a file; `SCENES` lists them by the name that users type."""

from .scales import Scale as Scale
from .scene import Scene as Scene
from .taylor_green import taylor_green as taylor_green
from .taylor_green import taylor_green_3d as taylor_green_3d

SCENES = {"taylor-green": taylor_green, "taylor-green-3d": taylor_green_3d}
