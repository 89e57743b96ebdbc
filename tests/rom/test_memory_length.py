"""Memory lengths from projected Jacobians, against dense matrices and finite differences."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsph.arrangements import Lattice
from jaxsph.io import read_trajectory
from jaxsph.scenes import lid_driven_cavity, taylor_green
from jaxsph_rom import (
    AdjointPetrovGalerkin,
    ConvectiveMemory,
    Energy,
    Experiment,
    Galerkin,
    LocalSplines,
    OnParticles,
    ReducedModel,
    ReducedState,
    SpectralMemory,
    Study,
    pod,
)
from jaxsph_rom.projection.spectral_radius import krylov_projection, spectral_radius


def reduced(scene, basis):
    values = basis.modes.reshape(len(basis.modes), -1)
    splines = LocalSplines.fit(np.asarray(scene.state.position), values, scene.space)
    return ReducedModel.of_scene(scene, basis, splines, Galerkin())


def vortex_and_waves(mach):
    """A model of five modes, the vortex, two sound waves and two shear flows; and the vortex."""
    scene = taylor_green(20, 100.0, arrangement=Lattice(), mach=mach, time_step=1e-3)
    x, y = 2 * np.pi * np.asarray(scene.state.position).T
    rest, zero = np.full(len(x), 1000.0), np.zeros(len(x))
    fields = [
        (rest, *np.asarray(scene.state.velocity).T),
        (rest, np.cos(x), zero),
        (rest + np.sin(x), zero, zero),
        (rest, np.sin(y), zero),
        (rest, zero, np.sin(x)),
    ]
    snapshots = np.stack([np.stack(field, axis=1) for field in fields], axis=2)
    model = reduced(scene, pod(snapshots, Energy(), scene.fluid, len(fields)))
    return model, eqx.filter_jit(model.project)(scene.state)


@pytest.fixture(scope="module")
def vortex():
    return vortex_and_waves(0.1)


@eqx.filter_jit
def rates(model, state):
    return model.rates(jnp.zeros(()), state, model.prepare(state)).coordinates


def dense(model, state, step=1e-4):
    """The projected Jacobian by central differences of the rates, column by column."""
    columns = []
    for direction in np.eye(state.coordinates.shape[0]):
        ahead, behind = (
            rates(model, ReducedState(state.coordinates + s * direction, state.position))
            for s in (step, -step)
        )
        columns.append((ahead - behind) / (2 * step))
    return np.stack(columns, axis=1)


def test_the_memory_length_is_that_of_the_dense_matrix(vortex):
    model, state = vortex
    eigenvalues = np.linalg.eigvals(dense(model, state))
    largest = eigenvalues[np.abs(eigenvalues).argmax()]
    assert abs(largest.imag) > abs(largest.real)  # a conjugate pair: sound
    for memory in (SpectralMemory(), SpectralMemory(0.05)):
        # the differences' own error: rates are smooth in the coordinates
        assert memory(model, state) == pytest.approx(memory.constant / abs(largest), rel=1e-6)


def test_sound_sets_the_spectral_length_and_the_flow_the_convective_one(vortex):
    """Doubling the sound speed halves the one and leaves the other."""
    rules = (SpectralMemory(), ConvectiveMemory())
    fast, flow = (memory(*vortex) for memory in rules)
    faster, same_flow = (memory(*vortex_and_waves(0.05)) for memory in rules)
    assert 0.2 / fast == pytest.approx(10.0 * 2 * np.pi, rel=0.15)  # c0 k, smoothed by the kernel
    assert faster == pytest.approx(0.5 * fast, rel=0.03)  # the flow adds its square
    assert same_flow == pytest.approx(flow, rel=0.03)
    assert flow > 3.0 * fast


def test_the_convective_part_is_known_beside_walls():
    scene = lid_driven_cavity(12, 100.0)
    rng = np.random.default_rng(0)
    fields = rng.normal(size=(scene.state.position.shape[0], 3, 3)) * 0.1
    fields[:, 0] = 1.0 + 0.01 * fields[:, 0]
    model = reduced(scene, pod(fields, Energy(), scene.fluid, 3))
    state = ReducedState(jnp.asarray([0.3, -0.2, 0.1]), scene.state.position)
    kept = ConvectiveMemory().kept(model)
    assert not kept.functional.effects
    found = ConvectiveMemory()(model, state)
    assert found == pytest.approx(0.2 / spectral_radius(dense(kept, state)), rel=1e-5)


@pytest.mark.parametrize("size", [1, 2, 5, 30])
def test_the_krylov_space_of_all_steps_is_exact(size):
    rng = np.random.default_rng(size)
    matrix = rng.normal(size=(size, size))  # far from normal
    found = krylov_projection(lambda v: jnp.asarray(matrix) @ v, jnp.ones(size), size)
    want = np.sort_complex(np.linalg.eigvals(matrix))
    np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(found)), want, atol=1e-9 * size)


def test_a_conjugate_pair_is_found_in_fewer_steps_than_modes():
    """Where a power iteration turns forever: rotations at many frequencies."""
    frequencies = np.arange(1.0, 26.0)
    frequencies[-1] = 40.0
    matrix = np.kron(np.diag(frequencies), [[0.0, 1.0], [-1.0, 0.0]])
    start = jnp.asarray(np.random.default_rng(0).normal(size=50))
    found = krylov_projection(lambda v: jnp.asarray(matrix) @ v, start, 20)
    assert spectral_radius(found) == pytest.approx(40.0, rel=1e-4)


def test_a_space_that_is_complete_early_adds_no_noise():
    """Rank two of twelve; eleven steps beyond it must not disturb the eigenvalues."""
    matrix = np.zeros((12, 12))
    matrix[:2, :2] = [[0.0, 7.0], [-7.0, 0.0]]
    start = jnp.ones(12)
    found = krylov_projection(lambda v: jnp.asarray(matrix) @ v, start, 12)
    assert spectral_radius(found) == pytest.approx(7.0, rel=1e-12)


def test_what_sets_no_memory_length_is_refused(vortex):
    model, state = vortex
    with pytest.raises(ValueError, match="constant: must be positive, got 0"):
        SpectralMemory(0.0)
    # cavities and plane flows start like this
    still = eqx.tree_at(lambda s: s.coordinates, state, jnp.zeros_like(state.coordinates))
    with pytest.raises(ValueError, match="at rest .convective.; give a number"):
        ConvectiveMemory()(model, still)
    lost = eqx.tree_at(lambda s: s.coordinates, state, jnp.full_like(state.coordinates, jnp.nan))
    with pytest.raises(ValueError, match="is nan 1/s"):
        SpectralMemory()(model, lost)


@pytest.mark.slow
def test_a_study_tells_rules_apart_and_goes_on(tmp_path):
    def make(reynolds):
        return taylor_green(12, reynolds, arrangement=Lattice(), end_time=0.04, time_step=0.01)

    def study(*rules):
        return [o.case for o in Study(make, tmp_path, OnParticles(rules)).run(experiment)]

    experiment = Experiment((100.0,), (100.0,), (2,))
    cases = study(AdjointPetrovGalerkin(1e-4), SpectralMemory(0.1))
    assert {case.projection for case in cases} == {"apg"}
    assert [case.memory for case in cases] == [None, "auto-0.1"]
    assert cases[0].tau == 1e-4 < cases[1].tau < 0.1
    files = {path.stem: path for path in (tmp_path / "reduced").rglob("*.h5")}
    assert files.keys() == {"m-2-apg-0.0001", "m-2-apg-auto-0.1"}
    recorded = read_trajectory(files["m-2-apg-auto-0.1"]).metadata["parameters"]["reduced"]
    assert recorded["tau"] == cases[1].tau
    stamp = files["m-2-apg-auto-0.1"].stat().st_mtime_ns
    assert study(SpectralMemory(0.1)) == cases[1:]
    assert files["m-2-apg-auto-0.1"].stat().st_mtime_ns == stamp
