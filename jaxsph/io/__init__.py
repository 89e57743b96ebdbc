"""Files: trajectories in HDF5."""

from .snapshot_blocks import snapshot_blocks as snapshot_blocks
from .trajectory_file import Checkpoint as Checkpoint
from .trajectory_file import TrajectoryFileError as TrajectoryFileError
from .trajectory_file import read_checkpoint as read_checkpoint
from .trajectory_file import read_trajectory as read_trajectory
from .trajectory_writer import TrajectoryWriter as TrajectoryWriter
from .trajectory_writer import check_target as check_target
