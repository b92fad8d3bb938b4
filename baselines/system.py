"""One system as reports compare it: who predicted, told what, on which split."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import Self

from mpmworlds.baselines.provenance import Provenance, constants_sha256
from mpmworlds.baselines.results import (
    PASSED_OVER,
    RESULTS,
    SUMMARY,
    Result,
    read_results,
)
from mpmworlds.metrics import VERSION, Row, best_of_n


class ComparisonError(ValueError):
    """Results that cannot be compared as they are."""


@dataclass(frozen=True)
class Told:
    """What a summary says of its evaluation."""

    samples: int
    """How many samples have results."""
    expected: int
    """How many should have."""
    troubles: Mapping[str, str]
    """Samples of which nothing could be said, and why."""


@dataclass(frozen=True, eq=False)
class System:
    """Results of one predictor in one regime on one split, all of them."""

    name: str
    """Name in tables: that of the predictor, unless another one is given."""
    folder: Path
    """Where its results lie."""
    provenance: Provenance
    """What its results have in common."""
    results: tuple[Result, ...]
    """All candidates of all samples."""
    told: Told | None = None
    """What its summary says; None if there is none."""

    @classmethod
    def read(cls, folder: Path, name: str = "") -> Self:
        """Read the folder of an evaluation.

        Raises
        ------
        ComparisonError
            If it holds no results, or those of an evaluation that has not ended.
        ResultsError
            If they cannot be read.
        """
        path = folder / RESULTS
        if not path.is_file():
            raise ComparisonError(
                f"{folder}: holds no {RESULTS}; name a folder that `mpmworlds evaluate "
                "--out` has written"
            )
        provenance, results = read_results(path)
        name = name or provenance.predictor
        told = _told(folder / SUMMARY)
        system = cls(name, folder, provenance, tuple(results), told)
        system._hold_to_whole_samples()
        system._hold_to_summary()
        return system

    @property
    def label(self) -> str:
        """Name and regime, which tell the systems of a split apart."""
        return f"{self.name}, {self.provenance.regime}"

    @cached_property
    def samples(self) -> dict[str, list[Result]]:
        """Candidates of each sample by number; samples sorted."""
        ordered = sorted(self.results, key=lambda r: (r.sample_id, r.candidate))
        return {
            sample: list(candidates)
            for sample, candidates in groupby(ordered, key=lambda r: r.sample_id)
        }

    def only(self, samples: Sequence[str]) -> Self:
        """The system on some of its samples."""
        kept = [result for name in sorted(samples) for result in self.samples[name]]
        return replace(self, results=tuple(kept))

    def chosen(self, metric: str) -> dict[str, Result]:
        """Candidate of each sample that a metric chooses by the prefix; samples sorted.

        Where there is one candidate there is no choice, so it needs no prefix.

        Raises
        ------
        ComparisonError
            If the evaluation has passed over what the metric chooses.
        """
        if metric not in self._choices:
            self._choices[metric] = self._choose(metric)
        return self._choices[metric]

    def rows(self, metric: str) -> list[Row]:
        """What the aggregate functions of the metrics take: a row for each sample."""
        return [result.row(self.label) for result in self.chosen(metric).values()]

    @cached_property
    def _choices(self) -> dict[str, dict[str, Result]]:
        return {}

    def _choose(self, metric: str) -> dict[str, Result]:
        several = [r for r in self.results if r.candidates > 1]
        picked = best_of_n(
            [result.row(self.label, of_prefix=True) for result in several],
            [result.row(self.label) for result in several],
            metric,
        )
        number = {row.sample_id: row.candidate for row in picked}
        found = {
            sample: candidates[number.get(sample, 0)]
            for sample, candidates in self.samples.items()
        }
        for sample, result in found.items():
            if result.outcome == PASSED_OVER:
                raise ComparisonError(
                    f"{self.folder}: {sample}: candidate {result.candidate} was passed "
                    f"over, but {metric} chooses it by the prefix; evaluate again"
                )
        return found

    def _hold_to_whole_samples(self) -> None:
        for sample, candidates in self.samples.items():
            numbers = [result.candidate for result in candidates]
            if numbers != list(range(candidates[0].candidates)):
                raise ComparisonError(
                    f"{self.folder}: incomplete: {sample} has candidates {numbers}, "
                    f"must be 0 to {candidates[0].candidates - 1}; evaluate again to "
                    "go on"
                )

    def _hold_to_summary(self) -> None:
        """Raise if results were added after the summary: a run that was stopped."""
        if self.told is not None and self.told.samples != len(self.samples):
            raise ComparisonError(
                f"{self.folder}: incomplete: {len(self.samples)} samples in {RESULTS}, "
                f"{self.told.samples} in {SUMMARY}; evaluate again to go on"
            )


def _told(path: Path) -> Told | None:
    if not path.is_file():
        return None
    try:
        summary = json.loads(path.read_text("utf-8"))
        return Told(
            int(summary["samples"]),
            int(summary["expected"]),
            dict(summary["troubles"]),
        )
    except (ValueError, LookupError, TypeError) as error:
        raise ComparisonError(f"{path}: is no summary ({error!r})") from error


def hold_together(systems: Sequence[System]) -> None:
    """Raise unless all results are of one release and of the metrics of this version.

    Raises
    ------
    ComparisonError
        Names the first folder that differs, and in what.
    """
    constants = constants_sha256()
    for system in systems:
        origin, folder = system.provenance, system.folder
        if origin.metrics_version != VERSION:
            raise ComparisonError(
                f"{folder}: scored by {origin.metrics_version}, must be {VERSION}; "
                "evaluate again with this version"
            )
        if origin.constants_sha256 != constants:
            raise ComparisonError(
                f"{folder}: scored with constants {origin.constants_sha256[:12]}, must "
                f"be those of this version, {constants[:12]}; evaluate again with it"
            )
        first = systems[0]
        if origin.release_sha256 != first.provenance.release_sha256:
            raise ComparisonError(
                f"{folder}: of release {origin.release_sha256[:12]}, must be that of "
                f"{first.folder}, {first.provenance.release_sha256[:12]}; evaluate "
                "both on one release"
            )


def hold_to_same_samples(systems: Sequence[System], remedy: str) -> None:
    """Raise unless all have the samples of the first one.

    Raises
    ------
    ComparisonError
        Names the systems and the samples that they do not share.
    """
    for other in systems[1:]:
        first = systems[0]
        differing = [
            f"only {one.folder} has {_few(sorted(one.samples.keys() - two.keys()))}"
            for one, two in ((first, other.samples), (other, first.samples))
            if one.samples.keys() - two.keys()
        ]
        if differing:
            raise ComparisonError(
                f"{first.folder} and {other.folder}: different samples: "
                f"{'; '.join(differing)}; {remedy}"
            )


def _few(names: Sequence[str], most: int = 3) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
