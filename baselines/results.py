"""The results file: one JSON line per sample and candidate, safe against any stop.

Lines are appended whole samples at a time and synced to the disk, so a run that is
killed loses at most the sample it was in, and the next run goes on from there. A file
holds results of one provenance only.
"""

import json
import logging
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Final

from mpmworlds.baselines.provenance import Provenance
from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.closeable import Closeable
from mpmworlds.files.journal import Journal, JournalBusyError
from mpmworlds.metrics import Row

log = logging.getLogger(__name__)


RESULTS: Final = "results.jsonl"  # in the folder of an evaluation
SUMMARY: Final = "summary.json"
CLIPS: Final = "clips"  # predicted continuations, SAMPLE.mp4
SCENES: Final = "scenes"  # scenes that were answered with, SAMPLE.yaml
PASSED_OVER: Final = "passed_over"
"""Outcome of a candidate that another one beats on the prefix, whatever the metric: it
is no failure, and need not be continued."""


class ResultsError(ValueError):
    """A results file that this evaluation must not touch."""


@dataclass(frozen=True)
class Result:
    """What one candidate came to on one sample."""

    sample_id: str
    """Evaluated sample."""
    family_id: str
    """Root parent of the sample."""
    materials: list[str]
    """Constitutive models in the scene, sorted."""
    object_types: list[str]
    """Types of the objects in the scene, sorted."""
    num_objects: int
    """Number of objects in the scene."""
    motion: float | None
    """Part of the foreground that changes in a second; None if it is not known."""
    ceiling: dict[str, float] | None
    """Noise ceiling of each metric; None where it has not been measured."""
    candidate: int
    """Number of the candidate, 0 to ``candidates`` - 1."""
    candidates: int
    """How many candidates the sample has."""
    outcome: str
    """``ok``, or how the candidate failed, or `PASSED_OVER`."""
    reason: str
    """Why it failed; empty if it did not."""
    continuation: dict[str, float] | None
    """Scores of the continuation; None for a failure, and for what was passed over."""
    prefix: dict[str, float] | None
    """Scores of the predictor's own prefix; None if it gives none, or failed."""
    curves: dict[str, list[float]] | None
    """Each metric at every frame or time of the continuation, to 6 decimals."""
    processor: str
    """Name of the processor that it was computed on."""

    def row(self, system: str, *, of_prefix: bool = False) -> Row:
        """Return what the aggregate functions of the metrics take."""
        return Row(
            sample_id=self.sample_id,
            family_id=self.family_id,
            system=system,
            candidate=self.candidate,
            outcome="ok" if of_prefix and self.prefix else self.outcome,
            scores=self.prefix if of_prefix else self.continuation,
        )


_HINTS: Final = {  # what a digest cannot tell
    "predictor_sha256": " (another class, or its source file has changed)",
    "release_sha256": " (another release, or it was built anew)",
}
_RESULT_KEYS = tuple(field.name for field in fields(Result))


def read_results(path: Path) -> tuple[Provenance, list[Result]]:
    """Read a finished results file.

    Parameters
    ----------
    path
        A ``results.jsonl``.

    Returns
    -------
    Provenance, list of Result
        What the rows have in common, and the rows in the order of the file.

    Raises
    ------
    ResultsError
        If the file is empty, a line cannot be read, or provenances are mixed.
    """
    lines = path.read_bytes().splitlines()
    if not lines:
        raise ResultsError(f"{path}: empty, must hold at least one result")
    rows = [_parse(path, number, line) for number, line in enumerate(lines, 1)]
    provenance = Provenance(**{f.name: rows[0][f.name] for f in fields(Provenance)})
    for number, row in enumerate(rows, 1):
        _hold_to(provenance, path, number, row)
    return provenance, [_result(row) for row in rows]


def _parse(path: Path, number: int, line: bytes) -> dict[str, Any]:
    try:
        row = json.loads(line)
    except ValueError as error:
        raise ResultsError(
            f"{path}: line {number} is no JSON ({error}); remove the file to start over"
        ) from error
    missing = {*_RESULT_KEYS, *(f.name for f in fields(Provenance))} - row.keys()
    if missing:
        raise ResultsError(f"{path}: line {number} has no {sorted(missing)}")
    return dict(row)


def _result(row: Mapping[str, Any]) -> Result:
    return Result(**{key: row[key] for key in _RESULT_KEYS})


def _hold_to(
    provenance: Provenance, path: Path, number: int, row: Mapping[str, Any]
) -> None:
    for key, expected in asdict(provenance).items():
        if row[key] != expected:
            raise ResultsError(
                f"{path}: line {number} has {key} = {row[key]!r}, must be "
                f"{expected!r}{_HINTS.get(key, '')}; results of different evaluations "
                "do not mix: choose another folder"
            )


class ResultsFile(Closeable):
    """A results file open for going on with, held by one process at a time.

    Parameters
    ----------
    path
        File to go on with. Made if it is not there.
    provenance
        What its rows must have in common with the new ones.

    Raises
    ------
    ResultsError
        If it holds other results, is damaged elsewhere than at its end, or is being
        written by another process.
    """

    def __init__(self, path: Path, provenance: Provenance) -> None:
        self.path = path
        self.provenance = provenance
        self._done: dict[str, list[Result]] = {}
        try:
            self._journal = Journal(path)
        except JournalBusyError as error:
            raise ResultsError(f"{error}, or choose another folder") from error
        try:
            self._recover()
        except BaseException:
            self._journal.close()
            raise

    def close(self) -> None:
        """Let go of the file."""
        self._journal.close()

    def get(self, sample_id: str) -> list[Result] | None:
        """Return the results of a sample, or None if it has not been evaluated."""
        return self._done.get(sample_id)

    def append(self, results: Sequence[Result]) -> None:
        """Record all candidates of one sample; on return they are on the disk."""
        self._journal.append(self._text(results))
        self._done[results[0].sample_id] = list(results)

    def _text(self, results: Sequence[Result]) -> str:
        common = asdict(self.provenance)
        lines = [json.dumps(asdict(result) | common) + "\n" for result in results]
        return "".join(lines)

    def put_in_order(self, names: Sequence[str]) -> None:
        """Write the file anew with samples in an order, whichever was done first.

        It is the last thing to do with it: what is appended later is lost.
        """
        ordered = [name for name in names if name in self._done]
        ordered += sorted(self._done.keys() - set(names))
        if ordered != list(self._done):
            text = "".join(self._text(self._done[name]) for name in ordered)
            write_atomically(self.path, text.encode())

    def _recover(self) -> None:
        """Read what is there, and cut off a sample that was not written whole."""
        whole = 0
        pending: list[Result] = []
        for number, line, end in self._journal.lines():
            row = _parse(self.path, number, line)
            _hold_to(self.provenance, self.path, number, row)
            pending.append(_result(row))
            self._hold_to_order(number, pending)
            if len(pending) == pending[0].candidates:
                self._done[pending[0].sample_id] = pending
                pending, whole = [], end
        dropped = self._journal.cut(whole)
        if dropped:
            log.warning(
                "%s: the last sample was not written whole; its %d bytes are dropped, "
                "and it is evaluated again",
                self.path,
                dropped,
            )

    def _hold_to_order(self, number: int, pending: Sequence[Result]) -> None:
        """Raise unless the candidates of a sample follow each other, once."""
        first, last = pending[0], pending[-1]
        in_order = (
            last.sample_id == first.sample_id
            and last.candidate == len(pending) - 1
            and last.sample_id not in self._done
        )
        if not in_order:
            raise ResultsError(
                f"{self.path}: line {number} is candidate {last.candidate} of "
                f"{last.sample_id}, out of order; remove the file to start over"
            )
