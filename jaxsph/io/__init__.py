"""Files: trajectories in HDF5, and what ParaView reads."""

from .body_shapes import BodyShapes as BodyShapes
from .body_shapes import read_body_shapes as read_body_shapes
from .body_shapes import read_walls_of as read_walls_of
from .body_shapes import walls_with_bodies as walls_with_bodies
from .growing_file import check_target as check_target
from .growing_file import unwritable as unwritable
from .lock import Lock as Lock
from .overview import Overview as Overview
from .overview import read_overview as read_overview
from .overview import read_snapshot as read_snapshot
from .recorded_forces import ForceHistory as ForceHistory
from .recorded_forces import read_forces as read_forces
from .saved_trajectory import save_trajectory as save_trajectory
from .snapshot_blocks import snapshot_blocks as snapshot_blocks
from .trajectory_file import Checkpoint as Checkpoint
from .trajectory_file import TrajectoryFileError as TrajectoryFileError
from .trajectory_file import read_box as read_box
from .trajectory_file import read_checkpoint as read_checkpoint
from .trajectory_file import read_trajectory as read_trajectory
from .trajectory_file import read_walls as read_walls
from .trajectory_writer import TrajectoryWriter as TrajectoryWriter
from .vtkhdf import write_vtkhdf as write_vtkhdf
from .whole_file import whole_file as whole_file
