"""The candidates of one sample: drawn as far as it takes, and scored.

Of several programs only the prefix is run, and of those that no metric can choose any
more not even that to its end; what a metric chooses is run to the end.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from mpmworlds.baselines.execution import Runnable, Runs, runnable
from mpmworlds.baselines.protocol import Answer, Candidate, Failure
from mpmworlds.baselines.results import PASSED_OVER
from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.metrics import METRICS, SCORED, View, score
from mpmworlds.metrics.reduction import Frames

SELECTIONS: Final = ("prefix", "all")
"""How one of several candidates is found: run only what the prefix may choose, or all
to the end, for what a perfect or no choice would be worth."""
CURVE_DIGITS: Final = 6
_MORE_THAN_ONE: Final = "one of several candidates, needs a prefix"

Scores = dict[str, float]


@dataclass(frozen=True)
class Scored:
    """What a candidate came to; scores as in `baselines.results.Result`."""

    outcome: str
    reason: str = ""
    continuation: Scores | None = None
    prefix: Scores | None = None
    curves: dict[str, list[float]] | None = None
    frames: Frames | None = None
    """The continuation that was scored."""


class Sample:
    """A sample whose candidates are compared with the truth.

    Parameters
    ----------
    prefix, continuation
        The truth, uint8 (T, N, N, 3).
    form
        What a program must draw.
    runs
        Where programs are run.
    """

    def __init__(
        self, prefix: Frames, continuation: Frames, form: VideoForm, runs: Runs
    ) -> None:
        self.prefix = View(prefix, "prefix")
        self.continuation = View(continuation, "continuation")
        self.form = form
        self._runs = runs

    def scored(self, answers: Sequence[Answer], selection: str) -> list[Scored]:
        """Score all candidates, in their order."""
        ready = [self._ready(answer, len(answers)) for answer in answers]
        if len(ready) > 1 and selection == "prefix":
            return self._chosen(ready)
        return [self._to_the_end(candidate) for candidate in ready]

    def _ready(self, answer: Answer, count: int) -> Candidate | Runnable | Failure:
        if isinstance(answer, Failure):
            return answer
        if not isinstance(answer, Candidate):
            return runnable(answer, self.form)
        if answer.prefix is None and count > 1:
            return Failure("no_prefix", _MORE_THAN_ONE)
        fault = _fault("continuation", answer.continuation, self.continuation)
        if fault is None and answer.prefix is not None:
            fault = _fault("prefix", answer.prefix, self.prefix)
        return fault or answer

    def _to_the_end(
        self, candidate: Candidate | Runnable | Failure, prefix: Scores | None = None
    ) -> Scored:
        """Run it and score it; of the prefix only where that has not been done."""
        if isinstance(candidate, Runnable):
            candidate = self._drawn(candidate)
        if isinstance(candidate, Failure):
            return Scored(candidate.outcome, candidate.reason, prefix=prefix)
        seen = View(candidate.continuation, "continuation")
        return Scored(
            "ok",
            continuation=score(seen, self.continuation),
            prefix=prefix or self._of_prefix(candidate.prefix),
            curves=_curves(seen, self.continuation),
            frames=candidate.continuation,
        )

    def _drawn(self, program: Runnable) -> Candidate | Failure:
        """All frames of a program."""
        found = self._runs.whole(program)
        if isinstance(found, Failure):
            return found
        known = self.prefix.shape[0]
        wanted = (known + self.continuation.shape[0], *self.prefix.clip.shape[1:])
        if found.shape != wanted:
            return Failure(
                "wrong_shape",
                f"the program draws {found.shape} as it is evaluated, must draw "
                f"{wanted}: {self.form}",
            )
        return Candidate(found[known:], found[:known])

    def _of_prefix(self, frames: Frames | None) -> Scores | None:
        return None if frames is None else score(View(frames, "prefix"), self.prefix)

    def _chosen(self, ready: Sequence[Candidate | Runnable | Failure]) -> list[Scored]:
        """Score the prefixes; go on with what a metric chooses."""
        race = _Race(self.prefix)
        entries: list[Failure | Scores | None] = []
        for number, candidate in enumerate(ready):
            if isinstance(candidate, Runnable):
                entries.append(self._begun(candidate, race))
            elif isinstance(candidate, Candidate):
                entries.append(self._of_prefix(candidate.prefix))
            else:
                entries.append(candidate)
            if isinstance(entry := entries[-1], dict):
                race.enter(number, entry)
            ahead = [ready[number] for number in race.winners()]
            self._runs.keep([one for one in ahead if isinstance(one, Runnable)])
        winners = race.winners()
        found = []
        for number, (candidate, entry) in enumerate(zip(ready, entries, strict=True)):
            if isinstance(entry, Failure):
                found.append(Scored(entry.outcome, entry.reason))
            elif number in winners or isinstance(candidate, Candidate):
                found.append(self._to_the_end(candidate, entry))
            else:
                reason = "another candidate is as good on the prefix, by any metric"
                found.append(Scored(PASSED_OVER, reason, prefix=entry))
        return found

    def _begun(self, program: Runnable, race: "_Race") -> Failure | Scores | None:
        found = self._runs.begin(program, race.is_lost)
        if found is None or isinstance(found, Failure):
            return found
        fault = _fault("prefix", found, self.prefix)
        return fault or self._of_prefix(found)


class _Race:
    """Which candidate is ahead on the prefix, by each metric that chooses."""

    def __init__(self, prefix: View) -> None:
        self._prefix = prefix
        self._ahead: dict[str, tuple[float, int]] = {}

    def enter(self, number: int, scores: Mapping[str, float]) -> None:
        """Take part with the scores of the whole prefix; ties go to the first."""
        for name, metric in METRICS.items():
            best = self._ahead.get(name)
            if best is None or metric.is_better(scores[name], best[0]):
                self._ahead[name] = scores[name], number

    def is_lost(self, begun: Frames) -> bool:
        """Whether a prefix that begins like this cannot win by any metric."""
        if not self._ahead or begun.shape[1:] != self._prefix.clip.shape[1:]:
            return False
        view = View(begun, "prefix")
        return not any(
            metric.is_better(
                metric.best_of_begun(view, self._prefix), self._ahead[name][0]
            )
            for name, metric in METRICS.items()
        )

    def winners(self) -> set[int]:
        """Candidates that some metric chooses."""
        return {number for _, number in self._ahead.values()}


def _curves(seen: View, truth: View) -> dict[str, list[float]]:
    return {
        name: np.round(metric.curve_of(seen, truth), CURVE_DIGITS).tolist()
        for name, metric in SCORED.items()
    }


def _fault(what: str, frames: Frames, reference: View) -> Failure | None:
    """What is wrong with frames that should be like the reference."""
    expected = reference.clip.shape
    if isinstance(frames, np.ma.MaskedArray):
        return Failure("wrong_type", f"{what} is a masked array; fill it")
    if not isinstance(frames, np.ndarray) or frames.dtype != np.uint8:
        kind = getattr(frames, "dtype", type(frames).__name__)
        return Failure(
            "wrong_type", f"{what} is {kind}, must be an array of uint8{_hint(frames)}"
        )
    if frames.shape != expected:
        hint = ""
        if frames.ndim == 4 and np.moveaxis(frames, 1, -1).shape == expected:
            hint = "; put the channels last"
        elif frames.shape[1:] == expected[1:]:
            hint = "; look at the frame rate and at where it begins"
        return Failure(
            "wrong_shape",
            f"{what} has shape {frames.shape}, must be {expected}{hint}",
        )
    return None


def _hint(frames: object) -> str:
    if (
        not isinstance(frames, np.ndarray)
        or frames.dtype.kind != "f"
        or not frames.size
    ):
        return ""
    if np.isnan(frames).any():
        return "; it has NaN"
    if frames.min() >= 0.0 and frames.max() <= 1.0:
        return "; multiply by 255 and round"
    return "; round"
