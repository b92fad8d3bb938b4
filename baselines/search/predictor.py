"""Program search as a predictor: scenes that draw the prefix, found by trying."""

from collections.abc import Mapping, Sequence
from typing import Any

from mpmworlds.baselines.protocol import Answer, Candidate, Failure, SceneText, Task
from mpmworlds.baselines.search.infer import Budget, infer
from mpmworlds.baselines.search.perception.colors import labels_of
from mpmworlds.baselines.search.prior import prior
from mpmworlds.baselines.search.settling import carried, matter_of, settled
from mpmworlds.baselines.search.side import read_side
from mpmworlds.metrics.reduction import reduce_clip
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import run
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
    """

    name = "search"

    def __init__(
        self,
        runs: int = Budget.runs,
        minutes: float = Budget.minutes,
        candidates: int = 4,
        seed: int = 0,
    ) -> None:
        if runs < 1 or not minutes > 0 or candidates < 1:
            raise ValueError(
                f"runs = {runs}, minutes = {minutes}, candidates = {candidates}: must "
                "be positive, or there is nothing to search with"
            )
        self._budget, self._candidates = Budget(runs, minutes), candidates
        self._seed = seed

    @property
    def configuration(self) -> Mapping[str, Any]:
        """What decides its answers."""
        return {
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
        return [answer(task, text) for text in found.scenes]


def answer(task: Task, text: str) -> Answer:
    """A scene, or what it draws with what has settled kept where it is seen."""
    labels, scene = labels_of(task.prefix), Scene.from_yaml(text)
    colors = settled(labels, matter_of(scene), prior().still)
    if not colors:
        return SceneText(text)
    outcome = run(link(scene), trusted=True)
    if outcome.status != "ok":
        return SceneText(text)  # how it fails is said where it is run again
    drawn = reduce_clip(outcome.frames, task.form.framerate)
    prefix = drawn[: len(task.prefix)]
    return Candidate(carried(drawn, labels, colors), prefix, text)


def _is_whole(side_info: str) -> bool:
    """Whether a regime tells the whole scene, so that nothing is to be sought."""
    if not side_info.strip():
        return False
    try:
        Scene.from_yaml(side_info)
    except ValueError:
        return False
    return True
