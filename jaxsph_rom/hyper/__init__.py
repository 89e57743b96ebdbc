"""Hyper-reduction: reduced models whose cost does not depend on the number of particles."""

from .closure import FittedClosure as FittedClosure
from .closure import ProjectedRun as ProjectedRun
from .closure import fit_linear_closure as fit_linear_closure
from .closure import rollout as rollout
from .eulerian_rates import EulerianRates as EulerianRates
from .flow_file import FlowFileError as FlowFileError
from .flow_file import load_flow as load_flow
from .flow_file import save_flow as save_flow
from .log_density import from_log_density as from_log_density
from .log_density import to_log_density as to_log_density
from .quadratic_system import QuadraticSystem as QuadraticSystem
from .quadratic_system import galerkin_system as galerkin_system
from .rate_snapshots import VisitedStates as VisitedStates
from .rate_snapshots import rate_basis as rate_basis
from .reduced_flow import ReducedFlow as ReducedFlow
from .reduced_flow import mapped_run as mapped_run
from .reference_operators import ReferenceOperators as ReferenceOperators
from .sampled_model import SampledModel as SampledModel
from .sampling import QDEIM as QDEIM
from .sampling import NonNegativeWeights as NonNegativeWeights
from .sampling import Samples as Samples
from .sampling import Sampling as Sampling
from .tensor_model import TensorModel as TensorModel
