"""Studies: train on full runs, predict, compare, report."""

from .full_runs import FullRuns as FullRuns
from .local_bases import LocalBases as LocalBases
from .method import Experiment as Experiment
from .method import Method as Method
from .on_particles import FAITHFUL as FAITHFUL
from .on_particles import OnParticles as OnParticles
from .on_points import OnPoints as OnPoints
from .plans import PLANS as PLANS
from .plans import Plan as Plan
from .quiet_start import quiet as quiet
from .recorded_run import full_run as full_run
from .recorded_run import with_record as with_record
from .settled import settled as settled
from .soundness import doubt as doubt
from .soundness import level_and_fluctuation as level_and_fluctuation
from .study import Outcome as Outcome
from .study import Study as Study
from .watch import TrainedPressure as TrainedPressure
from .write import write_study as write_study
