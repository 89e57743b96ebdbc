"""From full runs to a trained model."""

from .closure import FittedClosure as FittedClosure
from .closure import ProjectedRun as ProjectedRun
from .closure import fit_linear_closure as fit_linear_closure
from .closure import rollout as rollout
from .formulation import Compressible as Compressible
from .formulation import Formulation as Formulation
from .formulation import Solenoidal as Solenoidal
from .formulation import formulation_for as formulation_for
from .linear_closure import LinearClosure as LinearClosure
from .reduction import Reduction as Reduction
from .reduction import Samples as Samples
from .reduction import Tensors as Tensors
from .training import train as train
from .training import train_each as train_each
