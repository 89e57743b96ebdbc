"""A trained model, what it predicts, and how far to trust that."""

from .indicator import Indicator as Indicator
from .indicator import velocity_error as velocity_error
from .outputs import LinearOutput as LinearOutput
from .outputs import fit_forces as fit_forces
from .prediction import Prediction as Prediction
from .recovery import Recovery as Recovery
from .recovery import fit_recovery as fit_recovery
from .reduced_flow import ReducedFlow as ReducedFlow
from .reduced_flow import mapped_run as mapped_run
from .sweep import Sweep as Sweep
from .sweep import sweep as sweep
from .tracer_model import TracerModel as TracerModel
from .tracer_model import TracerState as TracerState
from .trained_model import TrainedModel as TrainedModel
