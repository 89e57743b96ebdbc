"""Hyper-reduction: reduced models whose cost does not depend on the number of particles."""

from .closure import FittedClosure as FittedClosure
from .closure import ProjectedRun as ProjectedRun
from .closure import fit_linear_closure as fit_linear_closure
from .closure import rollout as rollout
from .energy_bound import EnergyBound as EnergyBound
from .flow_file import load_flow as load_flow
from .flow_file import save_flow as save_flow
from .log_density import from_log_density as from_log_density
from .log_density import to_log_density as to_log_density
from .prediction import Prediction as Prediction
from .prediction import load_prediction as load_prediction
from .prediction import save_prediction as save_prediction
from .quadratic_system import QuadraticSystem as QuadraticSystem
from .quadratic_system import galerkin_system as galerkin_system
from .reduced_flow import ReducedFlow as ReducedFlow
from .reduced_flow import mapped_run as mapped_run
from .reference_operators import ReferenceOperators as ReferenceOperators
from .sweep import Sweep as Sweep
from .sweep import sweep as sweep
from .tensor_model import TensorModel as TensorModel
from .tracer_model import TracerModel as TracerModel
from .tracer_model import TracerState as TracerState
from .trained_flow import TrainedFlow as TrainedFlow
from .training import LinearClosure as LinearClosure
from .training import train_flows as train_flows
from .whole_file import FlowFileError as FlowFileError
