"""Scenes that reduced models know: a region that stays as it is."""

from jaxsph.scenes import Scene


def check_still(scene: Scene) -> None:
    """A ValueError if bodies are moved through the fluid of a scene."""
    if scene.walls is not None and scene.walls.bodies is not None:
        raise ValueError(
            f"scene: bodies are moved through the fluid of {scene.name}, and reduced models know "
            "of none; choose a scene whose walls stay or slide along themselves."
        )
