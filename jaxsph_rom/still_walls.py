"""Scenes that reduced models know: a region and particles that stay the same."""

from jaxsph.scenes import Scene


def check_still(scene: Scene) -> None:
    """A ValueError if bodies are moved through the fluid of a scene, or particles come and go."""
    check_same_particles(scene)
    if scene.walls is not None and scene.walls.bodies is not None:
        raise ValueError(
            f"scene: bodies are moved through the fluid of {scene.name}, and reduced models know "
            "of none; choose a scene whose walls stay or slide along themselves."
        )


def check_same_particles(scene: Scene) -> None:
    """A ValueError if particles come in and go out of a scene."""
    if scene.parking is not None:
        raise ValueError(
            f"scene: particles come in and go out of {scene.name}, and reduced models follow the "
            'same ones; learn from a flow with a fringe (ends="fringe").'
        )
