"""Studies: train on full runs, predict, compare, report."""

from .local_bases import LocalBases as LocalBases
from .recorded_run import recorded_run as recorded_run
from .study import Experiment as Experiment
from .study import Outcome as Outcome
from .study import Study as Study
from .write import write_study as write_study
