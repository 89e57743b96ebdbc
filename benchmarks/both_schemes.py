"""The paper's scheme and the one that is the default, which benchmarks compare."""

from jaxsph.schemes import Consistent, DeltaPlus

SCHEMES = {"delta-plus": DeltaPlus(), "consistent": Consistent()}
