"""Reduced models of a scheme that they do not know."""

import pytest

from jaxsph.arrangements import Lattice
from jaxsph.scenes import taylor_green
from jaxsph.schemes import Consistent
from jaxsph_rom.hyper.eulerian_rates import EulerianRates
from jaxsph_rom.hyper.reference_operators import ReferenceOperators


@pytest.mark.parametrize("kind", [EulerianRates, ReferenceOperators])
def test_the_consistent_scheme_is_refused_by_name(kind):
    scene = taylor_green(16, arrangement=Lattice(), scheme=Consistent())
    with pytest.raises(ValueError, match="DeltaPlus"):
        kind.of_scene(scene, scene.state.position)
