"""Sweeps: many full models at once, over parameters and seeds."""

from .sweep import sweep as sweep
from .sweep_file import SweepFileError as SweepFileError
from .sweep_file import read_member as read_member
from .sweep_file import read_member_forces as read_member_forces
from .sweep_file import read_status as read_status
