"""What a run tells its caller while it goes on."""

import logging

import numpy as np
import pytest

import jaxsph
from jaxsph.arrangements import Lattice


def test_a_run_is_logged_and_nothing_is_printed(caplog, capfd):
    scene = jaxsph.scenes.taylor_green(12, end_time=0.03, arrangement=Lattice())
    with caplog.at_level(logging.DEBUG, logger="jaxsph"):
        found = jaxsph.run_scene(scene)
    records = [r for r in caplog.records if r.name == "jaxsph.simulate"]
    started, *snapshots, ended = records
    assert started.getMessage().startswith("compiled in ")
    assert ended.getMessage().startswith(f"{scene.steps} steps in ")
    assert {started.levelname, ended.levelname} == {"INFO"}
    assert [r.levelname for r in snapshots] == ["DEBUG"] * (len(found.time) - 1)
    assert snapshots[-1].getMessage().endswith(f"t = {found.time[-1]:.4g} s")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("kind", ["forces", "torques"])
def test_a_force_that_is_no_number_is_named_and_not_recorded(kind):
    scene = jaxsph.scenes.taylor_green(12, end_time=0.03, arrangement=Lattice())
    good = {"forces": {"walls": np.zeros(2)}, "torques": {"walls": np.zeros(())}}
    bad = good | {kind: {"walls": np.full_like(good[kind]["walls"], np.nan)}}

    def measure(model, time, state):
        found = bad if float(time) > 0.0 else good
        return found["forces"], found["torques"]

    with pytest.raises(jaxsph.SimulationError, match="a value is not finite any more") as error:
        jaxsph.simulate(scene.model(), scene.state, scene.schedule, measure=measure)
    assert len(error.value.trajectory.time) == 1
