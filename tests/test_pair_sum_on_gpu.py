"""Pair sums as a GPU has them: its kernel, interpreted on this machine, against the CPU's sums.

Nothing here runs on a GPU. Its programs are lowered, so that each scene's terms are known to fit.
"""

import warnings

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.interpreters import mlir

from jaxsph import Box, PairTerm, Space, effects, pair_sum, pair_sum_on_gpu
from jaxsph.kernels import WendlandC2
from jaxsph.pair_rounding import without_rounding
from jaxsph.pair_sum_over_devices import lowered
from jaxsph.pairs import _one_by_one, pair_sum_p
from jaxsph.scenes import SCENES
from tests.test_pairs import HARDEST, Case
from tests.test_wall_sums import case as walled

FINER = {"open-cavity": 24, "channel-cylinder": 24, "piston-wave-maker": 64,
         "floating-box": 60, "dam-break-3d": 104}  # as their walls need  # fmt: skip
QUICK = ("taylor-green", "lid-driven-cavity", "dam-break", "oscillating-drop")  # unlike each other


def interpreted(*arguments, **parameters):
    return pair_sum_on_gpu.tiled_sums(*arguments, **parameters, interpret=True)


def computed(rule, function, *arguments):
    """What a function gives where pair sums are lowered by a rule; it must be traced anew."""
    mlir.register_lowering(pair_sum_p, lowered(pair_sum_p, mlir.lower_fun(rule)))
    try:
        return jax.jit(lambda *a: function(*a))(*arguments)
    finally:
        mlir.register_lowering(pair_sum_p, lowered(pair_sum_p, mlir.lower_fun(_one_by_one)))


def assert_equal(function, *arguments, rule=interpreted):
    """To round-off: the same summands, a tile's added up in another order."""
    exact = computed(_one_by_one, function, *arguments)
    found = computed(rule, function, *arguments)
    for a, b in zip(jax.tree.leaves(found), jax.tree.leaves(exact), strict=True):
        assert a.dtype == b.dtype and a.shape == b.shape
        size = float(jnp.max(jnp.abs(b)))
        assert size > 0.0
        np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-14 * size)


def of_both_modes(case):
    """Sums, their tangent and a gradient."""

    def function(moved, neighbors):
        value, tangent = jax.jvp(
            lambda m: case.sums(m, neighbors), (moved,), (case.direction,)
        )
        return value, tangent, jax.grad(case.scalar)(moved, neighbors)

    return function


@pytest.mark.parametrize("dim, side, names", [(2, 10, HARDEST), (3, 7, HARDEST[1:])])
def test_sums_and_derivatives_equal_the_cpus(dim, side, names):
    case = Case(dim, side, names)
    assert_equal(of_both_modes(case), case.moved, case.neighbors)


@pytest.mark.parametrize("rule", [interpreted, pair_sum_on_gpu.looped_sums], ids=["tile", "loop"])
def test_members_equal_the_cpus(rule):
    """Members with positions of their own, with one list."""
    case = Case(2, 8, HARDEST[1:2])
    moved = [case.along(0.02 * k) for k in range(3)]
    stacked = jax.tree.map(lambda *a: jnp.stack(a), *moved)
    every = jax.vmap(of_both_modes(case), (0, None))
    assert_equal(every, stacked, case.neighbors, rule=rule)


def test_sums_over_walls_equal_the_cpus():
    """Of chosen rows, with holes in the list where a part of the walls is left out."""
    one, terms = walled("2d"), effects.LaminarViscosity(0.01).rate_terms(None)
    held = jnp.arange(len(one.ghosts["volume"])) % 3 > 0
    some = eqx.tree_at(lambda n: n.wall, one.neighbors, one.neighbors.wall.only(held))

    def gradient(moved):
        sums, pull = jax.vjp(lambda m: one.sums(m, some, terms), moved)
        return sums, pull(sums)

    assert_equal(gradient, one.moved)


def test_a_neighbour_across_the_box_is_the_nearest_image():
    space = Space(Box.unit_periodic(2), WendlandC2(), 0.1, 0.05)
    near = np.linspace(-3.0, 3.0, 601)  # halves among them
    floored = without_rounding(lambda x: (space.box.minimum_image(x, 0),))
    found, exact = floored(near)[0], space.box.minimum_image(jnp.asarray(near), 0)
    same = np.abs(np.abs(exact) - 0.5) > 1e-12
    assert 580 < same.sum() < 601
    np.testing.assert_array_equal(found[same], exact[same])
    np.testing.assert_allclose(np.abs(found[~same]), 0.5, atol=1e-12)  # one image or the other
    assert "round" not in str(jax.make_jaxpr(floored)(near))


# ------------------------------------------------------------------ programs for a GPU


def kernels_of(function, *arguments):
    """Kernels of Triton in a program for a GPU."""
    traced = jax.jit(function).trace(*arguments)
    return traced.lower(lowering_platforms=("cuda",)).as_text().count("__gpu$xla.gpu.triton")


def test_members_and_derivatives_are_kernels_too():
    case = Case(2, 10, HARDEST)
    one = case.moved, case.neighbors
    many = jax.tree.map(lambda a: jnp.stack([a] * 5), one)
    assert kernels_of(case.sums, *one) == 1
    assert kernels_of(jax.vmap(case.sums), *many) == 1
    assert kernels_of(jax.vmap(case.jvp), *many) == 1  # of the tangent alone
    assert kernels_of(jax.vmap(jax.grad(case.scalar)), *many) == 2


@pytest.mark.parametrize(
    "name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in SCENES]
)
def test_the_terms_of_each_scene_fit_the_kernel(name):
    scene = SCENES[name](FINER.get(name, 12))
    model, state = scene.model(), scene.state
    lists = jax.eval_shape(model.search.build, state.position)
    with warnings.catch_warnings(action="error"):  # the loop comes with one
        kernels = kernels_of(lambda s, n: model.rates(jnp.zeros(()), s, n), state, lists)
    assert kernels >= 2


def test_a_term_that_does_not_fit_warns_and_is_summed_in_a_loop():
    case = Case(2, 10, HARDEST[:1])
    fields = jax.tree.map(case.neighbors.sort, case.fields)
    term = PairTerm("sorted", (), lambda pair, i, j: jnp.sort(pair.kernel, axis=-1))

    def sums(fields):
        return pair_sum((term,), fields, case.space, case.neighbors)

    with pytest.warns(UserWarning, match="Triton cannot compile a term.*sort"):
        assert kernels_of(sums, fields) == 0
