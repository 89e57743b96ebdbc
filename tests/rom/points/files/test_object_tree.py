"""Objects in a file: there and back, and what cannot be found again is refused."""

import dataclasses
from typing import NamedTuple

import equinox as eqx
import h5py
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph import Fluid
from jaxsph.fluid import TaitEquationOfState
from jaxsph.kernels import WendlandC4
from jaxsph.walls import BallRegion, BoxRegion, SignedDistance
from jaxsph_rom.points.files.object_tree import read, write


class Pair(NamedTuple):
    first: int
    second: np.ndarray


class Tree(eqx.Module):
    """Of all kinds of fields."""

    numbers: jnp.ndarray
    parts: tuple
    count: int = eqx.field(static=True)
    record: dict = eqx.field(static=True)
    nothing: None = None


def distance(x):
    return jnp.linalg.norm(x, axis=1) - 1.0


def there_and_back(path, value):
    with h5py.File(path, "w") as file:
        write(file, "value", value)
    with h5py.File(path, "r") as file:
        return read(file, "value")


def test_a_tree_comes_back(tmp_path):
    region = BoxRegion((0.0, 0.0), (1.0, np.inf)) & ~BallRegion((0.5, 0.5), 0.1)
    parts = (WendlandC4(), region, SignedDistance(distance), Pair(3, np.arange(2.0)), (), "text")
    record = {"a": 1.0, "b": [1, 2.5], "c": None}
    tree = Tree(jnp.asarray([1.0, 2.0]), parts, 7, record)
    found = there_and_back(tmp_path / "tree.h5", tree)
    assert isinstance(found, Tree) and found.count == 7 and found.nothing is None
    assert found.record == {"a": 1.0, "b": [1, 2.5], "c": None}
    np.testing.assert_array_equal(found.numbers, tree.numbers)
    assert found.parts[:3] == parts[:3] and found.parts[4:] == parts[4:]
    assert type(found.parts[3]) is Pair and found.parts[3].first == 3
    assert isinstance(found.parts[3].second, np.ndarray)


def test_a_fluids_equation_of_state_comes_back(tmp_path):
    fluid = Fluid(1000.0, 10.0, 1.0, TaitEquationOfState())
    found = there_and_back(tmp_path / "tree.h5", fluid)
    # c0^2 rho0 / 7 (1.05^7 - 1); a linear one has 5000 Pa
    wanted = 1e5 / 7.0 * (1.05**7 - 1.0)
    np.testing.assert_allclose(found.pressure(jnp.asarray(1050.0)), wanted, rtol=1e-6)
    assert wanted == pytest.approx(5816, abs=1.0)


def test_what_no_module_has_is_refused(tmp_path):
    @dataclasses.dataclass
    class Local:
        x: int = 1

    for value, match in (
        (Local(), "value: .*Local cannot be found again"),
        (SignedDistance(lambda x: x[:, 0]), "value.function: .*lambda.* cannot be found again"),
        ((1, object()), r"value.1: object has no place in a file"),
    ):
        with pytest.raises(ValueError, match=match):
            there_and_back(tmp_path / "tree.h5", value)
