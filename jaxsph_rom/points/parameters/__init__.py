"""Scenes of any parameters, and how numbers depend on these."""

from .family import Family as Family
from .laws import Between as Between
from .laws import Law as Law
