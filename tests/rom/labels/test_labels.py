"""Labels as a space: where particles have gone, modes over them, and when they mix."""

import dataclasses

import numpy as np
import pytest

from jaxsph import Box, Space, Trajectory
from jaxsph.arrangements import Lattice
from jaxsph.kernels import WendlandC2
from jaxsph_rom.labels import LabelBasis, displacement, label_snapshots, mixed_from, parted_share

SPACE = Space(Box((0.0, 0.0), (2.0, 1.0), (True, False)), WendlandC2(), 0.2, 0.1)
START = np.asarray(Lattice().positions(SPACE))


def moved(position) -> Trajectory:
    position = np.asarray(position)
    density = np.full(position.shape[:2], 1000.0)
    time = np.arange(len(position), dtype=float)
    return Trajectory(time, position, 0.0 * position, density, 0.0 * density)


def carried(way, times=7):
    """The lattice carried along by a way [m] a snapshot, wrapped as the full model has it."""
    paths = START[None] + np.arange(times)[:, None, None] * np.asarray(way)
    paths[..., 0] = paths[..., 0] % 2.0
    return moved(paths)


def test_displacements_go_on_across_a_periodic_face():
    found = displacement(carried((0.45, 0.0)), SPACE.box)
    wanted = 0.45 * np.arange(7)  # beyond the box's length
    np.testing.assert_allclose(found[:, :, 0], np.broadcast_to(wanted[:, None], found.shape[:2]))
    np.testing.assert_array_equal(found[:, :, 1], 0.0)


def test_motion_is_displacement_then_velocity():
    run = carried((0.1, 0.05), 3)
    run = dataclasses.replace(run, velocity=run.velocity + 2.0)
    motion, density = label_snapshots(run, SPACE.box)
    assert motion.shape == (3, 2 * START.size) and density.shape == (3, len(START))
    np.testing.assert_allclose(motion[2, : START.size : 2], 0.2)
    np.testing.assert_array_equal(motion[:, START.size :], 2.0)


def test_labels_that_go_together_do_not_mix():
    assert parted_share(carried((0.3, 0.02)), SPACE).max() == 0.0
    assert mixed_from(carried((0.3, 0.02)), SPACE) is None


def test_shear_without_end_parts_rows_and_is_dated():
    """Rows at u = y: neighbours of two rows are 0.1 t apart, out of reach (0.4 m) from t = 4 on."""
    paths = np.stack([START + np.stack([START[:, 1] * t, 0.0 * t * START[:, 1]], 1)
                      for t in np.arange(7)])  # fmt: skip
    share = parted_share(moved(paths), SPACE)
    np.testing.assert_array_equal(share[:3], 0.0)
    # of 4 pairs a particle, 1 is in its row and stays
    assert share[-1] == pytest.approx(0.75, abs=0.03)
    assert mixed_from(moved(paths), SPACE) in (3.0, 4.0)


def test_a_whole_basis_gives_snapshots_back_and_fields_count_alike():
    rng = np.random.default_rng(0)
    small, large = rng.normal(size=(9, 30)), 1e3 * rng.normal(size=(9, 30))
    snapshots = np.concatenate([small, large], axis=1)
    basis = LabelBasis.of(snapshots, 2, 20)
    assert basis.size == 8  # nine snapshots about their mean
    np.testing.assert_allclose(basis.modes.T @ basis.modes, np.eye(8), atol=1e-7)  # eps^(1/2)
    np.testing.assert_allclose(basis.numbers(basis.project(snapshots)), snapshots, rtol=1e-6)
    parts = ((snapshots - basis.centre) * basis.scale).reshape(9, 2, 30)
    np.testing.assert_allclose((parts**2).sum(axis=2).mean(axis=0), 1.0)
    assert LabelBasis.of(snapshots, 2, 3).size == 3
    single = LabelBasis.of(snapshots.astype(np.float32), 2, 20)
    assert single.modes.dtype == np.float32 and single.size == 8


@pytest.mark.parametrize(
    ("change", "message"),
    [(lambda a: a * np.nan, "not finite"), (lambda a: 0.0 * a, "same at all times")],
)
def test_snapshots_without_modes_are_named(change, message):
    with pytest.raises(ValueError, match=message):
        LabelBasis.of(change(np.random.default_rng(0).normal(size=(5, 8))), 2, 2)
