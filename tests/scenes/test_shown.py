"""What a scene says of itself, and the bar of its run."""

import jax

from jaxsph import run_scene
from jaxsph.arrangements import Lattice
from jaxsph.scenes import lid_driven_cavity, taylor_green


def test_a_scene_in_words():
    scene = taylor_green(16, arrangement=Lattice(), end_time=0.05)
    line, table = repr(scene), scene._repr_html_()
    for told in ("taylor-green", "256 in 2D", "0.0625 m", f"{scene.steps} of ", "0.05 s",
                 "AdjointPressure", "none"):  # fmt: skip
        assert told in line and told in table
    assert "\n" not in line and "Array" not in line
    walled = lid_driven_cavity(16)
    assert f"{len(walled.walls.position)} ghosts" in repr(walled)
    assert "position=None" in repr(jax.tree.map(lambda _: None, scene))


def test_a_bar_if_asked_for(tmp_path, capsys):
    scene = taylor_green(16, arrangement=Lattice(), end_time=0.05)
    run_scene(scene)
    assert capsys.readouterr() == ("", "")  # the library prints nothing by itself
    run_scene(scene, tmp_path / "t.h5", progress=True)
    done, steps = [], f"{scene.steps}/{scene.steps}"
    assert steps in capsys.readouterr().err
    run_scene(scene, progress=True)
    shown = capsys.readouterr()
    assert steps in shown.err and not shown.out
    run_scene(scene, progress=done.append)
    assert sum(done) == scene.steps
