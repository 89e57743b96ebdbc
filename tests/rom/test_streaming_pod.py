"""POD in blocks is the direct singular value decomposition, or close to it by a known bound."""

import tracemalloc

import numpy as np
import pytest

from jaxsph import Fluid, Snapshot
from jaxsph.arrangements import JitteredLattice
from jaxsph.io import TrajectoryWriter, read_trajectory, snapshot_blocks
from jaxsph.scenes import taylor_green
from jaxsph_rom import Energy, Euclidean, ReferenceSpace, pod, streaming_pod

FLUID = Fluid(1000.0, 10.0, 1.0)
PRODUCTS = [Euclidean(), Energy()]
EPS = np.finfo(float).eps
ROUND_OFF = 100 * EPS  # of up to 40 updates, relative to the largest singular value


def snapshots(points=40, times=30, decay=0.8, seed=0):
    """Velocities of order 1 and densities about 1000, singular values about decay^i."""
    rng = np.random.default_rng(seed)
    fields = rng.normal(size=(points, 3, times)) @ (
        decay ** np.arange(times)[:, None] * rng.normal(size=(times, times))
    )
    fields[:, 0] += 1000.0
    return fields


def split(data, size):
    return [data[:, :, k : k + size] for k in range(0, data.shape[2], size)]


def matrix(data, basis):
    """The snapshot matrix that is decomposed."""
    scaled = (data - basis.centre[:, :, None]) * np.sqrt(basis.weights)[None, :, None]
    return scaled.reshape(-1, data.shape[2])


def left(basis):
    """Left singular vectors, orthonormal in the plain sense."""
    return (basis.modes * np.sqrt(basis.weights)[None, :, None]).reshape(-1, basis.size)


@pytest.mark.parametrize("product", PRODUCTS)
@pytest.mark.parametrize("size", [1, 2, 7, 10, 29, 30, 100])
def test_equals_the_direct_decomposition(size, product):
    data = snapshots()
    direct, streamed = pod(data, product, FLUID), streaming_pod(split(data, size), product, FLUID)
    sigma = direct.singular_values
    np.testing.assert_array_equal(streamed.centre, direct.centre)
    np.testing.assert_array_equal(streamed.weights, direct.weights)
    np.testing.assert_allclose(streamed.singular_values, sigma, rtol=0, atol=ROUND_OFF * sigma[0])
    # a mode turns by the error of the matrix over the distance to the next singular value
    distance = np.abs(sigma[:, None] - sigma[None, :]) + np.diag(np.full(30, np.inf))
    aligned = left(streamed) * np.sign(np.sum(left(direct) * left(streamed), axis=0))
    error = np.linalg.norm(aligned - left(direct), axis=0)
    assert (error < ROUND_OFF * sigma[0] / distance.min(axis=1)).all()


@pytest.mark.parametrize("borders", [[1, 2, 9], [13], [5, 5, 6]])
def test_uneven_blocks(borders):
    data = snapshots()
    blocks = np.split(data, borders, axis=2)  # [5, 5, 6] has a block of no snapshots
    found = streaming_pod(blocks, Energy(), FLUID).singular_values
    wanted = pod(data, Energy(), FLUID).singular_values
    np.testing.assert_allclose(found, wanted, rtol=0, atol=ROUND_OFF * wanted[0])


@pytest.mark.parametrize("size", [1, 5, 20, 40])
def test_blocks_with_more_snapshots_than_a_state_has_numbers(size):
    data = snapshots(points=4, times=40)  # 12 rows
    direct, streamed = pod(data, Energy(), FLUID), streaming_pod(split(data, size), Energy(), FLUID)
    assert streamed.size == direct.size == 12
    sigma = direct.singular_values
    np.testing.assert_allclose(streamed.singular_values, sigma, rtol=0, atol=ROUND_OFF * sigma[0])
    np.testing.assert_allclose(left(streamed).T @ left(streamed), np.eye(12), atol=1e-14)


def test_modes_are_cut_as_those_of_the_direct_decomposition():
    data = snapshots()
    direct = pod(data, Energy(), FLUID, 4)
    streamed = streaming_pod(split(data, 7), Energy(), FLUID, modes=4)
    assert streamed.modes.shape == direct.modes.shape == (40, 3, 4)
    assert streamed.singular_values.shape == direct.singular_values.shape == (30,)
    assert streamed.modes.dtype == direct.modes.dtype
    overlap = left(direct).T @ left(streamed)
    np.testing.assert_allclose(np.abs(overlap), np.eye(4), atol=1e-13)


def test_runs_again_bit_by_bit():
    data = snapshots()
    first, again = (streaming_pod(split(data, 4), Energy(), FLUID, rank=9) for _ in range(2))
    np.testing.assert_array_equal(first.modes, again.modes)
    np.testing.assert_array_equal(first.singular_values, again.singular_values)


@pytest.mark.parametrize("product", PRODUCTS)
@pytest.mark.parametrize("size", [1, 5, 50])
@pytest.mark.parametrize("rank", [3, 10])
def test_a_rank_costs_no_more_than_the_bound(rank, size, product):
    data = snapshots(points=60, times=100)
    streamed = streaming_pod(split(data, size), product, FLUID, rank=rank)
    exact = pod(data, product, FLUID).singular_values
    found, steps = streamed.singular_values, -(-100 // size)
    assert len(found) == streamed.size == rank
    noise = ROUND_OFF * exact[0] ** 2
    assert (found**2 <= exact[:rank] ** 2 + noise).all()
    assert (found**2 >= exact[:rank] ** 2 - steps * exact[rank] ** 2 - noise).all()
    wanted = matrix(data, streamed)
    for modes in (1, rank):
        basis = left(streamed.truncated(modes))
        error = np.linalg.norm(wanted - basis @ (basis.T @ wanted)) ** 2
        assert error <= np.linalg.norm(wanted) ** 2 - (found[:modes] ** 2).sum() + noise
        assert error >= (exact[modes:] ** 2).sum() - noise  # the direct one is optimal


def test_three_times_the_modes_as_rank_leaves_them_all_but_exact():
    data = snapshots(points=60, times=100)
    direct = pod(data, Energy(), FLUID, 5)
    streamed = streaming_pod(split(data, 10), Energy(), FLUID, modes=5, rank=15)
    exact, found = direct.singular_values[:5], streamed.singular_values[:5]
    # the bound is 10 (s_16 / s_5)^2 / 2 = 3e-2, if each of 10 steps lost as much as it may; 3e-7
    np.testing.assert_allclose(found, exact, rtol=1e-5)
    overlap = np.linalg.svd(left(direct).T @ left(streamed), compute_uv=False)
    assert overlap.min() > 1 - 1e-7  # the cosine of the largest angle


def test_modes_stay_orthonormal_over_many_blocks():
    data = snapshots(points=30, times=500, decay=0.99)
    for rank in (None, 20):
        modes = left(streaming_pod(split(data, 1), Energy(), FLUID, rank=rank))
        # round-off of one QR and one product, not of five hundred
        np.testing.assert_allclose(modes.T @ modes, np.eye(modes.shape[1]), rtol=0, atol=1e-14)


def test_snapshots_that_repeat_add_no_modes():
    data = snapshots(times=3)
    basis = streaming_pod([data] * 20, Energy(), FLUID)
    assert basis.size == 3
    once = pod(data, Energy(), FLUID).singular_values
    np.testing.assert_allclose(basis.singular_values, np.sqrt(20) * once, rtol=1e-12)


def test_a_start_from_rest_is_no_trouble():
    """The energy product's centre is the state of rest: a column of zeros."""
    data = snapshots()
    data[:, 0, 0], data[:, 1:, 0] = 1000.0, 0.0
    basis = streaming_pod(split(data, 1), Energy(), FLUID)
    wanted = pod(data, Energy(), FLUID).singular_values
    assert basis.size == 29 and wanted[29] < 1e-12
    np.testing.assert_allclose(basis.singular_values, wanted[:29], atol=ROUND_OFF * wanted[0])
    with pytest.raises(ValueError, match="all 2 are the centre, which"):
        streaming_pod([data[:, :, :1]] * 2, Energy(), FLUID)


def test_single_precision_stays():
    data = snapshots().astype(np.float32)
    fluid = Fluid(*(np.float32(value) for value in (1000.0, 10.0, 1.0)))
    direct = pod(data, Energy(), fluid)
    streamed = streaming_pod(split(data, 7), Energy(), fluid)
    assert streamed.modes.dtype == direct.modes.dtype
    assert streamed.singular_values.dtype == direct.singular_values.dtype
    np.testing.assert_allclose(
        streamed.singular_values,
        direct.singular_values[: len(streamed.singular_values)],
        rtol=0,
        atol=100 * np.finfo(streamed.modes.dtype).eps * direct.singular_values[0],
    )


def test_memory_is_that_of_a_block_and_the_factors():
    points, times, size, rank = 4000, 400, 10, 20
    column = points * 3 * 8  # bytes

    def blocks():
        rng = np.random.default_rng(0)
        for _ in range(times // size):
            yield rng.normal(size=(points, 3, size))

    tracemalloc.start()
    try:
        streaming_pod(blocks(), Euclidean(), FLUID, modes=10, rank=rank)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    # U twice, a block and three arrays of its size; the matrix would be 400 columns
    assert peak < (2 * rank + 5 * size) * column


def test_a_file_read_in_blocks_gives_the_modes_of_the_whole(tmp_path):
    path = tmp_path / "trajectory.h5"
    scene = taylor_green(16, arrangement=JitteredLattice())
    position = np.asarray(scene.state.position)
    rng = np.random.default_rng(0)
    with TrajectoryWriter.create(path, scene) as writer:
        for k in range(9):
            moved = (position + 0.005 * rng.normal(size=position.shape)) % 1.0
            density = 1.0 + 0.01 * rng.normal(size=len(moved))
            fields = moved, rng.normal(size=moved.shape), density, 0 * density
            writer.append(k, 0.1 * k, Snapshot(*fields))
    reference = ReferenceSpace(scene.state.position, scene.space)
    blocks = (reference.snapshots(block) for block in snapshot_blocks(path, 4))
    streamed = streaming_pod(blocks, Energy(), scene.fluid, modes=5)
    direct = pod(reference.snapshots(read_trajectory(path)), Energy(), scene.fluid, 5)
    sigma = direct.singular_values
    np.testing.assert_allclose(streamed.singular_values, sigma, rtol=0, atol=ROUND_OFF * sigma[0])
    overlap = left(direct).T @ left(streamed)
    np.testing.assert_allclose(np.abs(overlap), np.eye(5), atol=1e-11)  # of values far apart


def test_more_modes_than_there_are_is_refused():
    blocks = split(snapshots(times=12), 5)
    with pytest.raises(ValueError, match="modes: 13 asked for, but 12 snapshots give 1 to 12"):
        streaming_pod(blocks, Euclidean(), FLUID, modes=13)
    with pytest.raises(ValueError, match="modes: 6 asked for, but rank 5 gives 1 to 5"):
        streaming_pod(blocks, Euclidean(), FLUID, modes=6, rank=5)
    for wanted in ({"modes": 0}, {"rank": 0}, {"modes": -1, "rank": 3}):
        with pytest.raises(ValueError, match=r"(modes|rank): (0|-1) asked for"):
            streaming_pod(blocks, Euclidean(), FLUID, **wanted)


def test_blocks_that_do_not_serve_are_refused():
    data = snapshots()
    with pytest.raises(ValueError, match="there is none in the blocks"):
        streaming_pod([], Euclidean(), FLUID)
    with pytest.raises(ValueError, match="there is none in the blocks"):
        streaming_pod([data[:, :, :0]], Euclidean(), FLUID)
    with pytest.raises(ValueError, match=r"\(39, 3\), the first one \(40, 3\)"):
        streaming_pod([data, data[1:]], Euclidean(), FLUID)
    with pytest.raises(ValueError, match="put a whole matrix into a list"):
        streaming_pod(data, Euclidean(), FLUID)
    spoilt = split(data, 10)
    spoilt[2] = np.where(np.arange(10) == 3, np.inf, spoilt[2])
    with pytest.raises(ValueError, match="a value is not finite"):
        streaming_pod(spoilt, Euclidean(), FLUID)
