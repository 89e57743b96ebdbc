"""Reduced models of flows with a free surface, whose fields live on the particles' own labels."""

from .cubic_system import CubicSystem as CubicSystem
from .displacement import displacement as displacement
from .displacement import label_snapshots as label_snapshots
from .inputs import Inputs as Inputs
from .label_basis import LabelBasis as LabelBasis
from .label_model import LabelModel as LabelModel
from .label_model import load as load
from .label_prediction import LabelPrediction as LabelPrediction
from .label_system import LabelSystem as LabelSystem
from .mixing import mixed_from as mixed_from
from .mixing import parted_share as parted_share
from .sampled_system import SampledSystem as SampledSystem
from .training import check_run as check_run
from .training import train as train
from .training import training_scenes as training_scenes
