"""What is done with a sample, wherever it is done: predict, score, report trouble."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Final

from mpmworlds.baselines.candidates import Sample, Scored
from mpmworlds.baselines.execution import Runs
from mpmworlds.baselines.protocol import (
    Answer,
    Answers,
    AnyPredictor,
    Candidate,
    Failure,
    InfrastructureError,
    Oracle,
    Precomputed,
    SceneText,
    Task,
)
from mpmworlds.baselines.provenance import processor
from mpmworlds.baselines.registry import predictor_named
from mpmworlds.baselines.results import Result
from mpmworlds.loaders.load import Example, example_of, neutral_name
from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.loaders.regimes import DEFAULT, regime_named
from mpmworlds.sim.run.encode import encode_unchecked
from mpmworlds.sim.run.run import SandboxError

INFRASTRUCTURE: Final = (InfrastructureError, SandboxError, OSError, MemoryError)
"""What is no sample's fault and no predictor's."""


@dataclass(frozen=True)
class Trouble:
    """Nothing can be said of a sample yet."""

    reason: str
    sandbox: bool = False
    """Whether a program could not be confined."""


@dataclass(frozen=True)
class Found:
    """What a sample came to."""

    results: list[Result]
    clip: bytes | None = None
    """MP4 of a continuation that was predicted, if it is to be kept."""
    scene: str = ""
    """Scene file of the candidate whose prefix overlaps best, if it is of one."""


@dataclass(frozen=True)
class How:
    """How samples are scored.

    Attributes
    ----------
    selection
        Which candidates are run to their end, of `candidates.SELECTIONS`.
    sandbox
        Whether programs that were not linked here are confined.
    clips
        Whether a predicted continuation is kept.
    """

    selection: str = "prefix"
    sandbox: bool = True
    clips: bool = False


HOW: Final = How()


@dataclass(frozen=True)
class Scoring:
    """Scores rows of a release by a predictor that is named; it pickles.

    Attributes
    ----------
    predictor
        See `baselines.registry.predictor_named`.
    options
        What it is made with.
    regime
        What it is told.
    how
        How samples are scored.
    """

    predictor: str
    options: Mapping[str, Any] = field(default_factory=dict)
    regime: str = DEFAULT
    how: How = HOW

    def __call__(self, row: dict[str, Any]) -> Found | Trouble:
        """Score a row."""
        options = json.dumps(dict(self.options), sort_keys=True)
        predictor = _made(self.predictor, options)
        return scored_or_trouble(
            example_of(row, regime_named(self.regime)), predictor, self.how
        )


@lru_cache(1)
def _made(name: str, options: str) -> AnyPredictor:
    """The predictor of this process: models are loaded once."""
    return predictor_named(name, json.loads(options))


def scored_or_trouble(
    example: Example, predictor: AnyPredictor, how: How
) -> Found | Trouble:
    """Score a sample, or say what is in the way."""
    try:
        return score_example(example, predictor, how)
    except INFRASTRUCTURE as error:
        reason = f"{type(error).__name__}: {error}"
        return Trouble(reason, isinstance(error, SandboxError))


def score_example(example: Example, predictor: AnyPredictor, how: How = HOW) -> Found:
    """Predict one sample and score every candidate; a failure is a result, too.

    Parameters
    ----------
    example
        Sample with its continuation, which the predictor does not get.
    predictor
        What predicts it. An exception that it raises is the outcome
        ``predictor_error``.
    how
        How candidates are run.

    Returns
    -------
    Found
        Its results: one per candidate, at least one.

    Raises
    ------
    InfrastructureError, SandboxError, OSError, MemoryError
        If nothing can be said of the sample.
    """
    task = task_of(example)
    answers = _answers(example, task, predictor)
    scene = str(example.row.get("scene", ""))
    with Runs(task.form, len(task.prefix), scene, sandbox=how.sandbox) as runs:
        sample = Sample(example.prefix, example.continuation, task.form, runs)
        scored = sample.scored(answers, how.selection)
    return Found(
        [_result(example, k, len(scored), one) for k, one in enumerate(scored)],
        _clip(scored, example.framerate) if how.clips else None,
        _scene(answers, scored),
    )


def task_of(example: Example) -> Task:
    """What a predictor gets of a sample: what the regime gives, and nothing else."""
    return Task(
        id=neutral_name(example.id),
        prefix=example.prefix,
        side_info=example.side_info,
        regime=example.regime.name,
        horizon=len(example.continuation),
        framerate=example.framerate,
        form=VideoForm.of_row(example.row),
    )


def _answers(example: Example, task: Task, predictor: AnyPredictor) -> Sequence[Answer]:
    try:
        if isinstance(predictor, Oracle):
            row = {**example.row, "id": example.id}
            answers = predictor.reveal(task, Answers(row, example.continuation))
        elif isinstance(predictor, Precomputed):
            answers = predictor.look_up(example.id, task)
        else:
            answers = predictor.predict(task)
    except INFRASTRUCTURE:
        raise
    except Exception as error:  # noqa: BLE001 - whatever it is, it is this sample's outcome
        return [Failure("predictor_error", f"{type(error).__name__}: {error}")]
    if not answers:
        return [Failure("no_candidate", "the predictor returned no candidate")]
    return answers


def _result(example: Example, number: int, count: int, scored: Scored) -> Result:
    return Result(
        sample_id=example.id,
        family_id=str(example.row["family_id"]),
        materials=sorted(example.row["materials"]),
        object_types=sorted(example.row["object_types"]),
        num_objects=int(example.row["num_objects"]),
        motion=example.row["motion"],
        ceiling=example.row["ceiling"],
        candidate=number,
        candidates=count,
        outcome=scored.outcome,
        reason=scored.reason,
        continuation=scored.continuation,
        prefix=scored.prefix,
        curves=scored.curves,
        processor=processor(),
    )


def _clip(scored: Sequence[Scored], framerate: int) -> bytes | None:
    """The continuation of the best candidate."""
    best = _best(scored)
    frames = None if best is None else scored[best].frames
    return None if frames is None else encode_unchecked(frames, framerate)


def _scene(answers: Sequence[Answer], scored: Sequence[Scored]) -> str:
    """The scene of the best candidate."""
    best = _best(scored)
    if best is None:
        return ""
    answer = answers[best]
    if isinstance(answer, SceneText):
        return answer.text
    return answer.scene if isinstance(answer, Candidate) else ""


def _best(scored: Sequence[Scored]) -> int | None:
    """Number of the best candidate that was continued, by the overlap of its prefix."""
    there = [number for number, one in enumerate(scored) if one.frames is not None]
    return max(
        there,
        key=lambda number: (scored[number].prefix or {}).get("mask_iou", 0.0),
        default=None,
    )
