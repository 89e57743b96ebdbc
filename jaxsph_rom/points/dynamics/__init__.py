"""Rates of reduced coordinates: tensors, or full rates at a few sampled points."""

from .base import Closable as Closable
from .base import Dynamics as Dynamics
from .coefficients import Coefficients as Coefficients
from .energy_bound import EnergyBound as EnergyBound
from .eulerian_rates import EulerianRates as EulerianRates
from .log_density import from_log_density as from_log_density
from .log_density import to_log_density as to_log_density
from .points_model import PointsModel as PointsModel
from .quadratic_system import QuadraticSystem as QuadraticSystem
from .quadratic_system import galerkin_system as galerkin_system
from .rate_snapshots import VisitedStates as VisitedStates
from .rate_snapshots import rate_basis as rate_basis
from .reference_operators import ReferenceOperators as ReferenceOperators
from .sampled_rates import SampledRates as SampledRates
from .sampling import QDEIM as QDEIM
from .sampling import Chosen as Chosen
from .sampling import NonNegativeWeights as NonNegativeWeights
from .sampling import Sampling as Sampling
from .solenoidal import divergence_matrix as divergence_matrix
from .solenoidal import solenoidal_basis as solenoidal_basis
from .solenoidal import without_divergence as without_divergence
