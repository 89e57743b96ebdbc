"""Solid walls: where they are, and the ghost particles that stand for them."""

from .free_body import FreeBody as FreeBody
from .geometry_files import outline_from_file as outline_from_file
from .geometry_files import solid_from_file as solid_from_file
from .moving_body import Bodies as Bodies
from .moving_body import MovingBody as MovingBody
from .outline import Outline as Outline
from .parts import WallPart as WallPart
from .region import BallRegion as BallRegion
from .region import BoxRegion as BoxRegion
from .region import Region as Region
from .region import SignedDistance as SignedDistance
from .sampled_distance import SampledDistance as SampledDistance
from .walls import MovingWall as MovingWall
from .walls import Walls as Walls
