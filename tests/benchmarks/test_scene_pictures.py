"""Pictures of scenes: run with options that they have, and drawn where the site looks for them."""

from PIL import Image

from benchmarks import scene_pictures
from jaxsph.scenes import SCENES
from jaxsph_command.commands import parser
from tests.runs import random_run


def test_each_scene_has_the_options():
    assert scene_pictures.OPTIONS.keys() == SCENES.keys() - {"dam-break"}  # has a film
    for name, options in scene_pictures.OPTIONS.items():
        words = ["run", name, *options.split()]
        assert parser("jaxsph", words).parse_args(words).t_end is None or "--t-end" in options


def test_a_picture_is_where_it_is_looked_for(tmp_path, monkeypatch):
    monkeypatch.setattr(scene_pictures, "FIGURES", tmp_path)
    scene_pictures.draw("taylor-green", random_run(tmp_path / "t.h5", count=2))
    with Image.open(tmp_path / "scene_taylor_green.png") as picture:
        assert min(picture.size) > 200
