"""Solid walls: where they are, and the ghost particles that stand for them."""

from .moving_body import Bodies as Bodies
from .moving_body import MovingBody as MovingBody
from .parts import WallPart as WallPart
from .region import BallRegion as BallRegion
from .region import BoxRegion as BoxRegion
from .region import Region as Region
from .region import SignedDistance as SignedDistance
from .walls import MovingWall as MovingWall
from .walls import Walls as Walls
