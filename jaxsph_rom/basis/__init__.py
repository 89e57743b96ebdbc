"""Bases of the state space from snapshots."""

from .block_pod import block_pod as block_pod
from .centring import Centring as Centring
from .centring import MeanCentred as MeanCentred
from .centring import RestCentred as RestCentred
from .centring import Uncentred as Uncentred
from .inner_product import Energy as Energy
from .inner_product import Euclidean as Euclidean
from .inner_product import InnerProduct as InnerProduct
from .low_pass import low_pass as low_pass
from .pod import Basis as Basis
from .pod import cumulative_energy as cumulative_energy
from .pod import pod as pod
from .streaming_pod import streaming_pod as streaming_pod
from .truncation import modes_for_energy as modes_for_energy
from .truncation import modes_for_error as modes_for_error
from .truncation import projection_errors as projection_errors
