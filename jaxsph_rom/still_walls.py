"""Scenes that reduced models know: a region that stays as it is."""

from jaxsph.effects import AdjointPressure
from jaxsph.scenes import Scene


def check_still(scene: Scene) -> None:
    """A ValueError if bodies are moved through the fluid of a scene."""
    if scene.walls is not None and scene.walls.bodies is not None:
        raise ValueError(
            f"scene: bodies are moved through the fluid of {scene.name}, and reduced models know "
            "of none; choose a scene whose walls stay or slide along themselves."
        )


def check_moving_particles(scene: Scene) -> None:
    """A ValueError if reduced models on moving particles do not know a scene's scheme."""
    check_still(scene)
    if any(isinstance(effect, AdjointPressure) for effect in scene.effects):
        raise ValueError(
            f"scheme: reduced models on moving particles know {scene.name} in the delta-plus "
            "scheme only; make the scene with scheme=jaxsph.schemes.DeltaPlus(), or take a model "
            "on reference points."
        )
