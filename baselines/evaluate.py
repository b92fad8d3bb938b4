"""The evaluation loop: predictor x samples -> results, summary, table."""

import hashlib
import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mpmworlds.baselines.protocol import (
    Answers,
    AnyPredictor,
    Candidate,
    Failure,
    Oracle,
    Task,
)
from mpmworlds.baselines.provenance import Provenance, processor
from mpmworlds.baselines.registry import predictor_named
from mpmworlds.baselines.results import Result, ResultsFile
from mpmworlds.baselines.summary import summarise_results, summary_table
from mpmworlds.files.atomic import write_atomically
from mpmworlds.loaders.load import Example, load
from mpmworlds.loaders.regimes import DEFAULT
from mpmworlds.metrics import SCORED, View, score
from mpmworlds.metrics.reduction import Frames

RESULTS = "results.jsonl"
SUMMARY = "summary.json"
TABLE = "summary.txt"
CURVE_DIGITS = 6


def evaluate(
    release_dir: Path | str,
    predictor_name: str,
    split: str,
    out_dir: Path | str,
    config: str = "tiny",
    limit: int | None = None,
    progress: bool = True,
    regime: str = DEFAULT,
) -> Path:
    """Evaluate a built-in predictor on a split of a release.

    Parameters
    ----------
    release_dir
        Folder of the release, with its SHA256SUMS.
    predictor_name
        A key of `registry.PREDICTORS`.
    split
        Split to evaluate on.
    out_dir
        Folder of the results. An evaluation that was stopped goes on from what is
        there; samples that are done are not computed again.
    config
        Configuration of the release.
    limit
        Evaluate only so many samples, the first ones of the split.
    progress
        Write a line per sample to standard error.
    regime
        What the predictor is told besides the prefix, a key of
        `mpmworlds.loaders.regimes.REGIMES`.

    Returns
    -------
    Path
        The summary, ``summary.json``. Beside it lie ``results.jsonl`` and
        ``summary.txt``, the table.

    Raises
    ------
    ResultsError
        If ``out_dir`` holds results of another predictor, release, split or version.
    ValueError
        If the predictor, the regime or the split is unknown, or there is no sample.
    """
    if limit is not None and limit < 1:
        raise ValueError(
            f"limit = {limit}, must be at least 1, or None for all samples"
        )
    predictor = predictor_named(predictor_name)
    release = Path(release_dir)
    examples = load(release, split=split, config=config, regime=regime)[:limit]
    provenance = Provenance.of(release, predictor, config, split, regime)
    return evaluate_examples(examples, predictor, provenance, Path(out_dir), progress)


def evaluate_examples(
    examples: Sequence[Example],
    predictor: AnyPredictor,
    provenance: Provenance,
    out_dir: Path,
    progress: bool = True,
) -> Path:
    """Evaluate any predictor on any examples; see `evaluate`.

    Parameters
    ----------
    examples
        Examples to predict, with their continuations.
    predictor
        What predicts them.
    provenance
        What the results have in common.
    out_dir
        Folder of the results.
    progress
        Write a line per sample to standard error.

    Returns
    -------
    Path
        The summary.
    """
    out_dir.mkdir(parents=True, exist_ok=True)
    results: list[Result] = []
    with ResultsFile(out_dir / RESULTS, provenance) as file:
        for number, example in enumerate(examples, 1):
            known = file.get(example.id)
            new = known or score_example(example, predictor)
            if not known:
                file.append(new)
            results += new
            if progress:
                outcomes = ", ".join(result.outcome for result in new)
                sys.stderr.write(f"{number}/{len(examples)} {example.id} {outcomes}\n")
    summary = summarise_results(provenance, results)
    path = out_dir / SUMMARY
    text = json.dumps(summary, indent=2, allow_nan=False) + "\n"
    write_atomically(out_dir / TABLE, summary_table(summary).encode())
    write_atomically(path, text.encode())
    return path


def score_example(example: Example, predictor: AnyPredictor) -> list[Result]:
    """Predict one sample and score every candidate; a failure is a result, too.

    Parameters
    ----------
    example
        Sample with its continuation, which the predictor does not get.
    predictor
        What predicts it. An exception that it raises is the outcome
        ``predictor_error``.

    Returns
    -------
    list of Result
        One per candidate, at least one.
    """
    task = task_of(example)
    answers: Sequence[Candidate | Failure]
    try:
        if isinstance(predictor, Oracle):
            known = Answers(example.row, example.continuation)
            answers = predictor.reveal(task, known)
        else:
            answers = predictor.predict(task)
    except Exception as error:  # noqa: BLE001 - whatever it is, it is this sample's outcome
        answers = [Failure("predictor_error", f"{type(error).__name__}: {error}")]
    if not answers:
        answers = [Failure("no_candidate", "the predictor returned no candidate")]
    return [
        _result(example, number, len(answers), _checked(answer, example, len(answers)))
        for number, answer in enumerate(answers)
    ]


def task_of(example: Example) -> Task:
    """What a predictor gets of a sample: what the regime gives, and nothing else."""
    neutral = hashlib.sha256(f"task of {example.id}".encode()).hexdigest()
    return Task(
        id=neutral[:16],
        prefix=example.prefix,
        side_info=example.side_info,
        horizon=len(example.continuation),
        framerate=example.framerate,
    )


def _checked(
    answer: Candidate | Failure, example: Example, count: int
) -> Candidate | Failure:
    """Return the answer, or the failure that it amounts to."""
    if isinstance(answer, Failure):
        return answer
    if answer.prefix is None and count > 1:
        return Failure("no_prefix", "one of several candidates, needs a prefix")
    fault = _fault("continuation", answer.continuation, example.continuation)
    if fault is None and answer.prefix is not None:
        fault = _fault("prefix", answer.prefix, example.prefix)
    return answer if fault is None else fault


def _fault(what: str, frames: Frames, reference: Frames) -> Failure | None:
    if not isinstance(frames, np.ndarray) or frames.dtype != np.uint8:
        kind = getattr(frames, "dtype", type(frames).__name__)
        return Failure("wrong_type", f"{what} is {kind}, must be an array of uint8")
    if frames.shape != reference.shape:
        expected = f"{frames.shape}, must be {reference.shape}"
        return Failure("wrong_shape", f"{what} has shape {expected}")
    return None


def _result(
    example: Example, number: int, count: int, answer: Candidate | Failure
) -> Result:
    outcome, reason = "ok", ""
    continuation = prefix = curves = None
    if isinstance(answer, Failure):
        outcome, reason = answer.outcome, answer.reason
    else:
        seen, truth = View(answer.continuation), View(example.continuation)
        continuation, curves = score(seen, truth), _curves(seen, truth)
        if answer.prefix is not None:
            prefix = score(answer.prefix, example.prefix)
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
        outcome=outcome,
        reason=reason,
        continuation=continuation,
        prefix=prefix,
        curves=curves,
        processor=processor(),
    )


def _curves(seen: View, truth: View) -> dict[str, list[float]]:
    return {
        name: np.round(metric.curve_of(seen, truth), CURVE_DIGITS).tolist()
        for name, metric in SCORED.items()
    }
