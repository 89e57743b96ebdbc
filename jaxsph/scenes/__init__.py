"""Scenes, one a file; `SCENES` lists them by the name that users type."""

from . import plane_flow_solution as plane_flow_solution
from . import taylor_green_solution as taylor_green_solution
from .backward_facing_step import backward_facing_step as backward_facing_step
from .balanced import balanced as balanced
from .channel_cylinder import channel_cylinder as channel_cylinder
from .composed import composed as composed
from .continued import continued as continued
from .couette import couette as couette
from .cylinder import cylinder as cylinder
from .dam_break import dam_break as dam_break
from .dam_break_3d import dam_break_3d as dam_break_3d
from .elliptic_drop import elliptic_drop as elliptic_drop
from .enclosed import enclosed_flow as enclosed_flow
from .ends import Ends as Ends
from .ends import FringeEnds as FringeEnds
from .ends import OpenEnds as OpenEnds
from .filling_tank import filling_tank as filling_tank
from .floating_box import floating_box as floating_box
from .flow_through import flow_through as flow_through
from .gresho_vortex import gresho_vortex as gresho_vortex
from .hydrostatic_tank import hydrostatic_tank as hydrostatic_tank
from .lid_driven_cavity import lid_driven_cavity as lid_driven_cavity
from .open_cavity import open_cavity as open_cavity
from .open_channel import open_channel as open_channel
from .oscillating_drop import oscillating_drop as oscillating_drop
from .piston_wave_maker import piston_wave_maker as piston_wave_maker
from .poiseuille import poiseuille as poiseuille
from .poiseuille_open import poiseuille_open as poiseuille_open
from .rotating_square_patch import rotating_square_patch as rotating_square_patch
from .scales import Scale as Scale
from .scene import Scene as Scene
from .shear_layer import shear_layer as shear_layer
from .sloshing import sloshing as sloshing
from .solution import Solution as Solution
from .standing_wave import standing_wave as standing_wave
from .taylor_couette import taylor_couette as taylor_couette
from .taylor_green import taylor_green as taylor_green
from .taylor_green import taylor_green_3d as taylor_green_3d

SCENES = {
    "taylor-green": taylor_green,
    "taylor-green-3d": taylor_green_3d,
    "lid-driven-cavity": lid_driven_cavity,
    "open-cavity": open_cavity,
    "couette": couette,
    "poiseuille": poiseuille,
    "poiseuille-open": poiseuille_open,
    "channel-cylinder": channel_cylinder,
    "cylinder": cylinder,
    "backward-facing-step": backward_facing_step,
    "hydrostatic-tank": hydrostatic_tank,
    "dam-break": dam_break,
    "dam-break-3d": dam_break_3d,
    "elliptic-drop": elliptic_drop,
    "gresho-vortex": gresho_vortex,
    "oscillating-drop": oscillating_drop,
    "piston-wave-maker": piston_wave_maker,
    "rotating-square-patch": rotating_square_patch,
    "shear-layer": shear_layer,
    "sloshing": sloshing,
    "standing-wave": standing_wave,
    "floating-box": floating_box,
    "filling-tank": filling_tank,
    "taylor-couette": taylor_couette,
}
