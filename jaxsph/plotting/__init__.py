"""Figures of particles and of runs; each a `matplotlib` figure of its own, without pyplot."""

from .animation import animate as animate
from .depth import depth_figure as depth_figure
from .fields import FIELDS as FIELDS
from .fields import ParticleField as ParticleField
from .forces import forces_figure as forces_figure
from .history import history_figure as history_figure
from .snapshot import snapshot_figure as snapshot_figure
from .style import save as save
from .vorticity import vorticity as vorticity
