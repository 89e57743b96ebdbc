"""What is read off a reduced flow."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxsph_rom
from jaxsph import run_scene
from jaxsph.scenes import couette
from jaxsph_rom.points import LinearOutput, fit_forces

DRAW = np.random.default_rng(0)


def test_a_linear_output_is_found_again():
    wanted = LinearOutput(jnp.asarray(DRAW.normal(size=(2, 3, 5))))
    values = [np.asarray([v]) for v in (0.1, 0.3, 0.7)]
    coordinates = [DRAW.normal(size=(20, 4)) for _ in values]
    outputs = [
        wanted(jnp.asarray(a), jnp.asarray(v)) for a, v in zip(coordinates, values, strict=True)
    ]
    found = LinearOutput.fit(coordinates, values, outputs, ridge=0.0)
    np.testing.assert_allclose(found.table, wanted.table, atol=1e-10)


def test_one_of_a_model_in_single_precision_is_in_single_precision():
    a = DRAW.normal(size=(9, 2)).astype("float32")
    output = LinearOutput.fit([a], [np.ones(1, "float32")], [a[:, :1]])
    found = output(jnp.asarray(a), jnp.ones(1, "float32"))
    assert found.dtype == jnp.float32
    np.testing.assert_allclose(found, a[:, :1], atol=1e-4)


def test_one_may_be_differentiated_and_swept():
    output = LinearOutput(jnp.asarray(DRAW.normal(size=(2, 1, 3))))
    a, values = jnp.asarray(DRAW.normal(size=(4, 2))), jnp.asarray([0.2])
    slope = jax.grad(lambda v: jnp.sum(output(a, v)))(values)
    ahead = jnp.concatenate([jnp.ones((4, 1)), a], axis=1)
    np.testing.assert_allclose(slope[0], jnp.sum(ahead @ output.table[1].T), rtol=1e-12)
    swept = jax.vmap(output, (0, None))(jnp.stack([a, 2.0 * a]), values)
    np.testing.assert_allclose(swept[0], output(a, values), rtol=1e-12)


@pytest.fixture(scope="module")
def plates():
    def make(reynolds):
        return couette(16, reynolds, h_over_dx=1.5, time_step=4e-3, end_time=0.4)

    points = [{"reynolds": reynolds} for reynolds in (5.0, 10.0)]
    runs = [run_scene(make(**point)) for point in points]
    return make, points, runs


def test_forces_of_an_unseen_flow_are_those_of_its_run(plates):
    make, points, runs = plates
    model = jaxsph_rom.train(make, points, modes=2, runs=runs)
    forces = fit_forces(model, runs, "walls")
    prediction = model.predict({"reynolds": 7.0})
    found = forces(prediction.coordinates[0], prediction.values[0])
    run = run_scene(make(7.0))
    late = run.time > 0.1
    force = run.forces["walls"][late, 0]
    np.testing.assert_allclose(found[late, 0], force, atol=0.05 * np.ptp(run.forces["walls"][:, 0]))


def test_what_is_not_there_is_named(plates):
    make, points, runs = plates
    model = jaxsph_rom.train(make, points, modes=2, runs=runs)
    with pytest.raises(ValueError, match="part: 'hull' is not among .* [(]walls[)]"):
        fit_forces(model, runs, "hull")
    with pytest.raises(ValueError, match="runs: 1 for 2 training points"):
        fit_forces(model, runs[:1], "walls")
    with pytest.raises(ValueError, match="outputs: 3 times for 6 numbers"):
        LinearOutput.fit([np.ones((3, 2))], [np.ones(1)], [np.ones((3, 1))])
    output = LinearOutput(jnp.ones((2, 1, 3)))
    for values in (jnp.ones(2), jnp.ones(()), jnp.ones((3, 1))):
        with pytest.raises(ValueError, match="values: 1 coefficients of one member"):
            output(jnp.ones((4, 2)), values)
    with pytest.raises(ValueError, match="outputs: 1 runs of them, 2 of coordinates"):
        LinearOutput.fit([np.ones((3, 2))] * 2, [np.ones(1)], [np.ones((3, 1))])
