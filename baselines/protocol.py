"""What a predictor is: a task in, answers out.

A task carries what its regime gives, and nothing else. What tells how well anything
could do is handed the answers by a door of its own, and results say so.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias, runtime_checkable

from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.metrics.reduction import Frames


@dataclass(frozen=True, eq=False)
class Task:
    """What a predictor is given for one sample. The continuation is not in it."""

    id: str
    """Name of the sample that says nothing of it, the same in every run."""
    prefix: Frames
    """The frames that have been seen."""
    side_info: str
    """What the regime tells of the scene; empty if it tells nothing."""
    regime: str
    """Name of the regime, see `mpmworlds.loaders.regimes`."""
    horizon: int
    """Number of frames to predict."""
    framerate: int
    """Frames per second of prefix and continuation. [1/s]"""
    form: VideoForm
    """What a program must draw, from the beginning of the prefix."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """One predicted continuation."""

    continuation: Frames
    """``horizon`` frames of the size of the prefix."""
    prefix: Frames | None = None
    """The predictor's own rendering of the prefix, by which candidates are ranked."""
    scene: str = ""
    """The scene file that it was drawn from, which is kept; empty if there is none."""


@dataclass(frozen=True)
class ProgramText:
    """A program that draws prefix and continuation; it is run in a sandbox."""

    text: str
    """Python, with a generator ``frames()`` of the task's `VideoForm`."""


@dataclass(frozen=True)
class SceneText:
    """A scene, whose program is linked and run."""

    text: str
    """YAML of a scene file, with an output of the task's `VideoForm`."""


class InfrastructureError(RuntimeError):
    """Nothing can be said of the sample: a server, a network or a machine failed.

    For predictors to raise. The sample is tried again and never scored as a failure.
    """


@dataclass(frozen=True)
class Failure:
    """A candidate that came to nothing, which is a result as well."""

    outcome: str
    """One word that says how, e.g. ``timeout``; never ``ok``."""
    reason: str
    """What happened, for a human reader."""

    def __post_init__(self) -> None:
        """Refuse the name of the one outcome that is no failure."""
        if self.outcome == "ok":
            raise ValueError(
                f"failure {self.reason!r}: outcome 'ok', must be a word for the failure"
            )


Answer: TypeAlias = Candidate | ProgramText | SceneText | Failure


class Predictor(Protocol):
    """Something that continues videos."""

    @property
    def name(self) -> str:
        """Name in result files and tables."""
        ...

    def predict(self, task: Task, /) -> Sequence[Answer]:
        """Predict one sample.

        Parameters
        ----------
        task
            What may be known about the sample.

        Returns
        -------
        sequence of Candidate, ProgramText, SceneText or Failure
            At least one, in an order that a repetition gives again. Several candidates
            need a ``prefix`` each, since one of them is selected by its prefix;
            programs and scenes draw their own.

        Raises
        ------
        InfrastructureError, OSError, MemoryError
            If it is not its fault. Any other exception is its failure on this sample.
        """
        ...


@dataclass(frozen=True, eq=False)
class Answers:
    """What no predictor may know of a sample."""

    row: Mapping[str, Any]
    """Its row of the release, without its video: id, scene, program, lineage."""
    continuation: Frames
    """The frames that are to be predicted."""


@runtime_checkable
class Oracle(Protocol):
    """Something that knows the answers, and shows what a prediction could be worth."""

    @property
    def name(self) -> str:
        """Name in result files and tables."""
        ...

    def reveal(self, task: Task, answers: Answers, /) -> Sequence[Answer]:
        """As `Predictor.predict`, with the answers at hand."""
        ...


@runtime_checkable
class Precomputed(Protocol):
    """Predictions that were made elsewhere, by the ids of their samples."""

    @property
    def name(self) -> str:
        """Name in result files and tables."""
        ...

    def look_up(self, sample_id: str, task: Task, /) -> Sequence[Answer]:
        """As `Predictor.predict`, of a sample that is named."""
        ...


AnyPredictor: TypeAlias = Predictor | Oracle | Precomputed
