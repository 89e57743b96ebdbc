"""Matrix products keep their factors' precision on a GPU; options follow the platform."""

import re

import equinox as eqx
import jax
import jax.numpy as jnp
import pytest

from jaxsph import COMPILER_OPTIONS, platform_options
from jaxsph.arrangements import Lattice
from jaxsph.compiled import compiled, full_precision
from jaxsph.integrate import integrate
from jaxsph.interpolation import QuadraticMap
from jaxsph.scenes import oscillating_drop, taylor_green


def products(function, *arguments, platform="cuda"):
    """Precisions of all matrix products in a program."""
    text = jax.jit(function).trace(*arguments).lower(lowering_platforms=(platform,)).as_text()
    lines = [line for line in text.splitlines() if "stablehlo.dot_general" in line]
    return [re.findall(r"precision = \[(\w+), (\w+)\]", line) for line in lines]


def assert_full(function, *arguments):
    found = products(function, *arguments)
    assert found and all(each == [("HIGHEST", "HIGHEST")] for each in found)


def test_a_map_to_points_and_its_derivative_are_in_full_precision():
    scene = taylor_green(16, arrangement=Lattice(), dtype="float32")
    to_points = QuadraticMap.allocate(scene.state.position[:5], scene.space)

    def total(position, values):
        return jnp.sum(to_points(position, values)[0])

    assert_full(jax.grad(total, (0, 1)), scene.state.position, scene.state.velocity)


@pytest.mark.parametrize("whole_run", [False, True], ids=["a right-hand side", "a run"])
def test_effects_with_matrices_are_in_full_precision(whole_run):
    scene = oscillating_drop(12, dtype="float32")
    model, state = scene.model(), scene.state
    zero = jnp.zeros((), jnp.float32)
    if whole_run:
        assert_full(lambda s: integrate(model, s, jnp.int32(0), zero, 1, 1), state)
    else:
        lists = jax.eval_shape(model.search.build, state.position)
        assert_full(lambda s, n: model.rates(zero, s, n), state, lists)


def test_full_precision_reaches_inner_programs_and_ends_with_the_call():
    inner = eqx.filter_jit(lambda a: a @ a)
    a = jnp.ones((3, 3))
    assert_full(full_precision(lambda a: inner(a)), a)
    assert products(inner, a) == [[("DEFAULT", "DEFAULT")]] or products(inner, a) == [[]]


def test_options_are_those_of_the_platform():
    assert platform_options("cpu") == COMPILER_OPTIONS == platform_options()  # tests run on a CPU
    assert platform_options("cuda") == {}
    double = compiled(lambda a, b=1.0: 2.0 * a + b)
    assert float(double(jnp.asarray(2.0), b=jnp.asarray(3.0))) == 7.0
