"""Scenes of a manifest, read back quickly."""

import yaml
from pydantic import ValidationError

from mpmworlds.files.machine_yaml import read_machine_yaml
from mpmworlds.sim.scene.scene import Scene


def recorded_scene(text: str, source: str) -> Scene:
    """Read a scene that `Scene.to_yaml` wrote, without checking its layout again.

    Parameters
    ----------
    text
        Canonical text of a scene.
    source
        What it is the scene of, for the error.

    Returns
    -------
    Scene
        The scene; its fields have been checked.

    Raises
    ------
    ValueError
        If the text is no scene.
    """
    try:
        data = read_machine_yaml(text)
        objects = {"objects": tuple(data["objects"])}
        return Scene.model_validate(data | objects)
    except (yaml.YAMLError, ValidationError, TypeError, KeyError) as error:
        fault = " ".join(str(error).split())[:120]
        raise ValueError(
            f"{source}: its scene cannot be read ({fault}); write the manifest again"
        ) from None
