"""Bases of the state space from snapshots."""

from .inner_product import Energy as Energy
from .inner_product import Euclidean as Euclidean
from .inner_product import InnerProduct as InnerProduct
from .pod import Basis as Basis
from .pod import cumulative_energy as cumulative_energy
from .pod import pod as pod
from .streaming_pod import streaming_pod as streaming_pod
