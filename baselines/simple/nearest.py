"""The training sample that begins most alike: its video, or its program run again."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path

from mpmworlds.baselines.filling import filled, scene_of, told_scene
from mpmworlds.baselines.protocol import Answer, Candidate, Failure, ProgramText, Task
from mpmworlds.baselines.thumbnails import Thumbnails, thumbnail
from mpmworlds.loaders.load import Examples, load
from mpmworlds.loaders.locate import resolve
from mpmworlds.sim.scene.scene import Scene


class _Nearest:
    """Looks up training samples by small pictures of their prefixes.

    Parameters
    ----------
    release
        Folder of a release; the one that ``load_dataset("mpmworlds")`` finds if empty.
    config, split
        Where the training samples are.
    """

    def __init__(
        self, release: str = "", config: str = "tiny", split: str = "train"
    ) -> None:
        self._named, self._config, self._split = release, config, split

    @property
    def configuration(self) -> Mapping[str, str]:
        """What is in the release counts, not where it lies."""
        return {"release": "", "thumbnails_sha256": self._thumbnails.sha256}

    @cached_property
    def _release(self) -> Path:
        return Path(self._named or resolve())

    @cached_property
    def _thumbnails(self) -> Thumbnails:
        return Thumbnails.of(self._release, self._config, self._split)

    @cached_property
    def _examples(self) -> Examples:
        return load(self._release, self._split, self._config)

    def _nearest(self, task: Task) -> int:
        return self._thumbnails.nearest(thumbnail(task.prefix))


class NearestVideo(_Nearest):
    """Continues as the nearest training video does."""

    name = "nearest_video"

    def predict(self, task: Task) -> Sequence[Candidate]:
        """Return its continuation."""
        found = self._examples[self._nearest(task)]
        return [Candidate(found.continuation, found.prefix)]


class NearestProgram(_Nearest):
    """Runs the program of the nearest training sample, with what is given put in.

    Where the regime tells a scene with gaps, the gaps are filled from the neighbour's.
    """

    name = "nearest_program"

    def predict(self, task: Task) -> Sequence[Answer]:
        """Return that program, or the scene with gaps filled."""
        row = self._examples.table[self._nearest(task)]
        told = told_scene(task.side_info)
        if told is None:
            return [ProgramText(str(row["program"]))]
        base = Scene.from_yaml(str(row["scene"])).to_data()
        try:
            return [scene_of(filled(told, base))]
        except KeyError as error:
            return [Failure("invalid_scene", f"nothing to fill {error} from")]
