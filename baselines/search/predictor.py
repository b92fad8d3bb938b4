"""Program search as a predictor: scenes that draw the prefix, found by trying."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mpmworlds.baselines.protocol import Answer, Failure, SceneText, Task
from mpmworlds.baselines.search.infer import Budget, infer
from mpmworlds.baselines.search.side import read_side
from mpmworlds.files.atomic import write_atomically
from mpmworlds.sim.scene.scene import Scene


class ProgramSearch:
    """Looks for the scene behind a prefix by simulating scenes that it may be of.

    Parameters
    ----------
    runs, minutes
        Budget of a sample: runs of the prefix, and estimated minutes of one core that
        these take. What ends it is the same on every machine.
    candidates
        Largest number of scenes to answer with.
    seed
        Which draws.
    scenes
        Folder where the likeliest scene of each sample is kept, by the sample's neutral
        name; none if empty.
    """

    name = "search"

    def __init__(
        self,
        runs: int = 40,
        minutes: float = 3.0,
        candidates: int = 3,
        seed: int = 0,
        scenes: str = "",
    ) -> None:
        if runs < 1 or not minutes > 0 or candidates < 1:
            raise ValueError(
                f"runs = {runs}, minutes = {minutes}, candidates = {candidates}: must "
                "be positive, or there is nothing to search with"
            )
        self._budget, self._candidates = Budget(runs, minutes), candidates
        self._seed, self._scenes = seed, scenes

    @property
    def configuration(self) -> Mapping[str, Any]:
        """What decides its answers; not where they are kept."""
        return {
            "scenes": "",
            "runs": self._budget.runs,
            "minutes": self._budget.minutes,
            "candidates": self._candidates,
            "seed": self._seed,
        }

    def predict(self, task: Task) -> Sequence[Answer]:
        """Return scenes, the likeliest first; a failure if nothing can be found."""
        if _is_whole(task.side_info):
            return [SceneText(task.side_info)]
        try:
            found = infer(
                task.prefix,
                task.framerate,
                task.form,
                read_side(task.side_info),
                self._budget,
                self._candidates,
                self._seed,
            )
        except ValueError as error:
            return [Failure("no_scene", str(error))]
        if self._scenes:
            path = Path(self._scenes) / f"{task.id}.yaml"
            path.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(path, found.scenes[0].encode())
        return [SceneText(text) for text in found.scenes]


def _is_whole(side_info: str) -> bool:
    """Whether a regime tells the whole scene, so that nothing is to be sought."""
    if not side_info.strip():
        return False
    try:
        Scene.from_yaml(side_info)
    except ValueError:
        return False
    return True
