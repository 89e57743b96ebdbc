"""Which points stand for all of them, and with what weights, one method a file."""

from .base import Chosen as Chosen
from .base import Sampling as Sampling
from .non_negative_weights import NonNegativeWeights as NonNegativeWeights
from .q_deim import QDEIM as QDEIM
