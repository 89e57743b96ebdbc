"""Solid walls: where they are, and the fixed ghost particles that stand for them."""

from .region import BallRegion as BallRegion
from .region import BoxRegion as BoxRegion
from .region import Region as Region
from .region import SignedDistance as SignedDistance
from .walls import MovingWall as MovingWall
from .walls import Walls as Walls
