"""The reduced model: Eulerian functional, projections, limiting cases."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxsph
from jaxsph import ParticleState
from jaxsph.arrangements import Lattice, Packed
from jaxsph.scenes import taylor_green, taylor_green_solution
from jaxsph.schemes import DeltaPlus
from jaxsph_rom import (
    AdjointPetrovGalerkin,
    Basis,
    ConsistentAdvection,
    Energy,
    Euclidean,
    Galerkin,
    LocalSplines,
    ModeAdvection,
    PaperAdvection,
    ReducedModel,
    ReducedState,
    ReferenceSpace,
    pod,
)
from jaxsph_rom.projection import PseudoInverse

ZERO = jnp.zeros(())


@pytest.fixture(scope="module")
def scene():
    return taylor_green(12, 100.0, arrangement=Packed(iterations=50), scheme=DeltaPlus())


@pytest.fixture(scope="module")
def disturbed(scene):
    """A state off the exact solution, so that no term vanishes."""
    rng = np.random.default_rng(0)
    s = scene.state
    return ParticleState(
        s.position,
        s.velocity + 0.1 * jnp.asarray(rng.normal(size=s.velocity.shape)),
        s.density + jnp.asarray(rng.normal(size=s.density.shape)),
    )


def reduced(scene, modes, projection, product=None, advection=None):
    product = Euclidean() if product is None else product
    dim, fluid = scene.space.box.dim, scene.fluid
    basis = Basis(
        modes,
        product.centring.centre(modes, fluid),
        np.asarray(product.weights(fluid, dim)),
        np.ones(modes.shape[2]),
    )
    values = modes.reshape(len(modes), -1)
    splines = LocalSplines.fit(np.asarray(scene.state.position), values, scene.space, 3)
    return ReducedModel.of_scene(scene, basis, splines, projection, advection)


def rates(model, state):
    return eqx.filter_jit(lambda m, s: m.rates(ZERO, s, m.prepare(s)))(model, state)


@pytest.mark.parametrize("advection", [PaperAdvection(), ConsistentAdvection()])
def test_a_full_basis_reproduces_the_full_models_rates(scene, disturbed, advection):
    """With as many modes as states, on the reference points, the coordinates are the state."""
    particles = scene.state.position.shape[0]
    full_basis = np.eye(3 * particles).reshape(particles, 3, 3 * particles)
    model = reduced(scene, full_basis, Galerkin(), advection=advection)
    state = eqx.filter_jit(model.project)(disturbed)
    found = rates(model, state)
    neighbors = scene.search().build(disturbed.position)
    expected = scene.functional()(ZERO, disturbed, neighbors)
    np.testing.assert_allclose(found.position, expected.position, atol=1e-9)
    # back to the quasi-Lagrangian rates: add field advection, written here as plain sums
    shift = expected.position - disturbed.velocity
    carrier = disturbed.velocity + (shift if isinstance(advection, ConsistentAdvection) else 0.0)
    density, velocity = dense_advection(scene, disturbed, carrier)
    if isinstance(advection, ConsistentAdvection):
        # the shift part of the momentum advection carries the factor rho0 / rho of the scheme
        _, whole = dense_advection(scene, disturbed, shift)
        ratio = (1000.0 / np.asarray(disturbed.density) - 1.0)[:, None]
        velocity = velocity + ratio * whole
    lagrangian = found.coordinates.reshape(particles, 3) + np.concatenate(
        [density[:, None], velocity], axis=1
    )
    scale = np.abs(expected.density).max()
    np.testing.assert_allclose(lagrangian[:, 0], expected.density, atol=1e-9 * scale)
    np.testing.assert_allclose(lagrangian[:, 1:], expected.velocity, atol=1e-9 * 100)


def dense_advection(scene, state, carrier):
    """grad rho . c and grad u . c as the paper's sums, over all pairs (NumPy)."""
    x, u, rho = (np.asarray(a) for a in (state.position, state.velocity, state.density))
    c = np.asarray(carrier)
    d = x[None] - x[:, None]
    d -= np.round(d)
    r = np.linalg.norm(d, axis=-1)
    slope = scene.space.kernel.gradient_over_r(jnp.asarray(r), scene.space.smoothing_length, 2)
    volume = float(scene.mass) / rho
    gradient = -np.asarray(slope)[..., None] * d * volume[None, :, None]
    there, here = (c[None] * gradient).sum(-1), (c[:, None] * gradient).sum(-1)
    divergence = (there - here).sum(1)
    density = (rho[None] * there + rho[:, None] * here).sum(1) - rho * divergence
    velocity = (u[None] * there[..., None] + u[:, None] * here[..., None]).sum(1)
    return density, velocity - u * divergence[:, None]


@pytest.mark.parametrize("advection", [PaperAdvection(), ConsistentAdvection()])
def test_the_eulerian_rate_of_the_vortex_is_its_decay(advection):
    """du/dt at a fixed place is -2 nu k^2 u; the lattice keeps particle noise out."""
    scene = taylor_green(32, 100.0, arrangement=Lattice(), scheme=DeltaPlus())
    functional = eqx.tree_at(
        lambda f: f.effects,
        scene.functional(),
        advection.eulerian(scene.effects),
        is_leaf=lambda x: isinstance(x, tuple),
    )
    found = functional(ZERO, scene.state, scene.search().build(scene.state.position))
    exact = -2.0 * 0.01 * taylor_green_solution.WAVENUMBER**2 * scene.state.velocity
    error = jnp.linalg.norm(found.velocity - exact) / jnp.linalg.norm(exact)
    # inviscid forces, 8 times the viscous one, cancel up to the second-order error of the sums
    assert error < 0.1
    share = jnp.vdot(found.velocity, exact) / jnp.vdot(exact, exact)
    assert 0.97 < share < 1.03


def some_modes(scene, count=4):
    x = np.asarray(scene.state.position)
    waves = [np.cos(2 * np.pi * (x @ k)) for k in ([0, 0], [1, 0], [0, 1], [1, 1], [1, -1])]
    rng = np.random.default_rng(1)
    raw = np.stack(waves, 1) @ rng.normal(size=(5, 3 * count))
    columns, _ = np.linalg.qr(raw.reshape(len(x) * 3, count))
    return columns.reshape(len(x), 3, count)


def test_petrov_galerkin_without_memory_is_galerkin(scene, disturbed):
    modes = some_modes(scene)
    results = []
    for projection in (Galerkin(), AdjointPetrovGalerkin(0.0)):
        model = reduced(scene, modes, projection, Energy())
        results.append(rates(model, eqx.filter_jit(model.project)(disturbed)))
    # to round-off: the second program takes a Jacobian too, and XLA may round elsewhere in it
    size = np.abs(results[0].coordinates).max()
    np.testing.assert_allclose(*(r.coordinates for r in results), rtol=0.0, atol=1e-14 * size)
    np.testing.assert_array_equal(results[0].position, results[1].position)


@pytest.mark.parametrize("advection", [PaperAdvection(), ModeAdvection()], ids=["paper", "modes"])
def test_memory_is_the_jacobian_on_the_unresolved_rates(scene, disturbed, advection):
    """The memory term of apg against a central difference of f-bar, to 1e-6."""
    modes = some_modes(scene)
    model = reduced(scene, modes, AdjointPetrovGalerkin(1.0), Energy(), advection)
    plain = reduced(scene, modes, Galerkin(), Energy(), advection)
    state = eqx.filter_jit(model.project)(disturbed)
    memory = rates(model, state).coordinates - rates(plain, state).coordinates

    full = model.reconstruct(state)
    neighbors = model.prepare(state)
    inverse = model.pseudo_inverse(model.basis_at(state.position)[0])
    flat = jnp.concatenate([full.density[:, None], full.velocity], axis=1).reshape(-1)

    @jax.jit
    def f_bar(stacked):
        where = state.position, neighbors, state.coordinates
        return model.stacked_rates(ZERO, stacked, *where)[0]

    unresolved = inverse.complement(f_bar(flat))
    eps = 1e-4 / float(jnp.abs(unresolved).max())
    central = (f_bar(flat + eps * unresolved) - f_bar(flat - eps * unresolved)) / (2 * eps)
    expected = inverse(central)
    np.testing.assert_allclose(memory, expected, atol=1e-6 * np.abs(expected).max())


def test_the_rates_do_not_depend_on_the_centre(scene, disturbed):
    """A centre that varies is carried to the particles: other coordinates, the same rates."""
    modes, shift = some_modes(scene), np.array([0.3, -2.0, 1.0, 0.5])
    models = [reduced(scene, modes, Galerkin(), Energy())]
    basis = eqx.tree_at(lambda b: b.centre, models[0].basis, models[0].basis.centre + modes @ shift)
    splines = LocalSplines.fit(
        np.asarray(scene.state.position), basis.functions.reshape(len(modes), -1), scene.space
    )
    models.append(ReducedModel.of_scene(scene, basis, splines, Galerkin()))
    moved = eqx.tree_at(lambda s: s.position, disturbed, disturbed.position + 0.01)
    states = [eqx.filter_jit(m.project)(moved) for m in models]
    np.testing.assert_allclose(states[1].coordinates + shift, states[0].coordinates, atol=1e-8)
    full = [eqx.filter_jit(m.reconstruct)(s) for m, s in zip(models, states, strict=True)]
    np.testing.assert_allclose(full[1].density, full[0].density, atol=1e-8)
    np.testing.assert_allclose(full[1].velocity, full[0].velocity, atol=1e-8)
    found = [rates(m, s) for m, s in zip(models, states, strict=True)]
    scale = np.abs(found[0].coordinates).max()
    np.testing.assert_allclose(found[1].coordinates, found[0].coordinates, atol=1e-7 * scale)
    np.testing.assert_allclose(found[1].position, found[0].position, atol=1e-8)
    with pytest.raises(ValueError, match="interpolation: of 12 functions, but the basis has 15"):
        ReducedModel.of_scene(scene, basis, models[0].interpolation, Galerkin())


def test_the_pseudo_inverse_is_weighted_least_squares():
    rng = np.random.default_rng(0)
    basis, weights = rng.normal(size=(60, 5)), rng.uniform(0.5, 2.0, 60)
    vector = rng.normal(size=60)
    inverse = PseudoInverse(jnp.asarray(basis), jnp.asarray(weights))
    root = np.sqrt(weights)
    expected = np.linalg.lstsq(basis * root[:, None], vector * root, rcond=None)[0]
    np.testing.assert_allclose(inverse(jnp.asarray(vector)), expected, atol=1e-12)
    residual = inverse.complement(jnp.asarray(vector))
    np.testing.assert_allclose(basis.T @ (weights * residual), 0.0, atol=1e-11)


@pytest.fixture(scope="module")
def trained():
    scene = taylor_green(24, 50.0, h_over_dx=2.5, end_time=0.2)
    run = jaxsph.run_scene(scene)
    reference = ReferenceSpace(scene.state.position, scene.space)
    return scene, run, reference, reference.snapshots(run)


@pytest.mark.parametrize("projection", [Galerkin(), AdjointPetrovGalerkin(1e-4)])
def test_the_reduced_model_follows_the_decay(trained, projection):
    """One mode is the decaying vortex: its amplitude follows the full model's."""
    scene, run, reference, snapshots = trained
    basis = pod(snapshots, Energy(), scene.fluid, 1)
    values = basis.modes.reshape(len(basis.modes), -1)
    splines = LocalSplines.fit(np.asarray(reference.points), values, scene.space)
    model = ReducedModel.of_scene(scene, basis, splines, projection)
    start = eqx.filter_jit(model.project)(scene.state)
    result = jaxsph.simulate(
        model,
        start,
        scene.schedule,
    )
    assert result.coordinates.shape == (len(run.time), 1)
    energy = [np.sum(t.velocity[-1] ** 2) / np.sum(t.velocity[0] ** 2) for t in (run, result)]
    assert abs(energy[1] / energy[0] - 1) < 0.03  # measured below 0.01; decays by exp(-0.63)
    assert energy[0] < 0.6


def test_a_blow_up_is_named(trained):
    scene, _, reference, snapshots = trained
    basis = pod(snapshots, Energy(), scene.fluid, 3)
    values = basis.modes.reshape(len(basis.modes), -1)
    splines = LocalSplines.fit(np.asarray(reference.points), values, scene.space)
    model = ReducedModel.of_scene(scene, basis, splines, Galerkin())
    start = eqx.filter_jit(model.project)(scene.state)
    wild = ReducedState(start.coordinates * 1e3, start.position)
    with pytest.raises(jaxsph.SimulationError, match="step 1"):
        jaxsph.simulate(model, wild, jaxsph.Schedule(scene.time_step, 2, 2))


def test_a_memory_length_in_double_precision_leaves_single_precision_alone():
    ones = jnp.ones(4, jnp.float32)
    inverse = PseudoInverse(jnp.eye(4, 2, dtype=jnp.float32), ones)
    projection = AdjointPetrovGalerkin(np.float64(0.1))
    rates, _ = projection.reduce(inverse, lambda state: (jnp.float32(2.0) * state, ()), ones)
    assert rates.dtype == jnp.float32
