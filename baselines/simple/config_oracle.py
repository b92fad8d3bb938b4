"""Scenes that are given, or nearly so: what it is worth to know each part of them."""

from collections.abc import Sequence
from importlib.resources import files
from typing import Any, Final

import numpy as np
import yaml

from mpmworlds.baselines.filling import scene_of
from mpmworlds.baselines.protocol import Answers, Failure, SceneText, Task
from mpmworlds.builder.recipes.tables import Tables, read_tables
from mpmworlds.metrics.reduction import Frames
from mpmworlds.sim.scene.scene import Scene

VERSION: Final = "v1"


class ConfigOracle:
    """Answers with the scene that it is told: needs no insight, only the simulator."""

    name = "config_oracle"
    regimes = ("full_config",)

    def predict(self, task: Task) -> Sequence[SceneText]:
        """Return the side information."""
        return [SceneText(task.side_info)]


class TypicalMaterials:
    """Knows the scene and the class of each material, but no parameter of any.

    They are those that the class typically has in the corpus.
    """

    name = "config_oracle_typical_materials"
    regimes = ("no_materials",)

    def __init__(self) -> None:
        path = files("mpmworlds").joinpath("params.yaml")
        data: Any = yaml.safe_load(path.read_text("utf-8"))
        self._tables: Tables = read_tables(data["tables"], VERSION)

    def reveal(self, task: Task, answers: Answers) -> Sequence[SceneText | Failure]:
        """Return the scene of the row with typical materials."""
        data = Scene.from_yaml(str(answers.row["scene"])).to_data()
        for thing in data["objects"]:
            if "physics_properties" in thing:
                name = thing["physics_properties"]["constitutive_model"]
                typical = {"constitutive_model": name} | self._tables.typical[name]
                thing["physics_properties"] = typical
        return [scene_of(data)]


class SeenPositions:
    """Knows the scene but where things are, which it reads off the first frame.

    A thing is where the pixels of its colour are, if only one thing has it; what cannot
    be seen is in the middle.
    """

    name = "config_oracle_seen_positions"
    regimes = ("no_positions",)

    def reveal(self, task: Task, answers: Answers) -> Sequence[SceneText | Failure]:
        """Return the scene of the row with things where they are seen."""
        data = Scene.from_yaml(str(answers.row["scene"])).to_data()
        for thing in data["objects"]:
            color = thing["visualization"]["color"]
            thing["shape"]["center"] = _middle(task.prefix[0], color)
        return [scene_of(data)]


def _middle(frame: Frames, color: str) -> list[float]:
    """Center of the pixels of a colour, in m; of the domain if there is none."""
    rgb = np.array([int(color[k : k + 2], 16) for k in (1, 3, 5)], np.uint8)
    rows, columns = np.nonzero((frame == rgb).all(axis=2))
    if not rows.size:
        return [0.5, 0.5]
    height, width = frame.shape[:2]
    x, y = (columns.mean() + 0.5) / width, 1.0 - (rows.mean() + 0.5) / height
    return [round(float(x), 4), round(float(y), 4)]
