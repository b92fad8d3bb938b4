"""What a predictor is: a task in, candidates out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from mpmworlds.metrics.reduction import Frames


@dataclass(frozen=True, eq=False)
class Task:
    """What a predictor is given for one sample. The continuation is not in it."""

    id: str
    """Sample to predict."""
    prefix: Frames
    """The frames that have been seen."""
    horizon: int
    """Number of frames to predict."""
    framerate: int
    """Frames per second of prefix and continuation. [1/s]"""
    row: Mapping[str, Any]
    """The sample's row of the release, without its video: scene, program, lineage."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """One predicted continuation."""

    continuation: Frames
    """``horizon`` frames of the size of the prefix."""
    prefix: Frames | None = None
    """The predictor's own rendering of the prefix, by which candidates are ranked."""


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


class Predictor(Protocol):
    """Something that continues videos."""

    @property
    def name(self) -> str:
        """Name in result files and tables."""
        ...

    def predict(self, task: Task) -> Sequence[Candidate | Failure]:
        """Predict one sample.

        Parameters
        ----------
        task
            What may be known about the sample.

        Returns
        -------
        sequence of Candidate or Failure
            At least one, in an order that a repetition gives again. Several candidates
            need a ``prefix`` each, since one of them is selected by its prefix.
        """
        ...
