"""The prefix-quality gate: run the program if its prefix is good, else fall back.

A program is kept on a sample where its prefix score p is better than a threshold tau;
elsewhere the fallback answers. tau is chosen for each metric on the split
`modification_validation`, never on `test`.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

from mpmworlds.baselines.results import Result
from mpmworlds.baselines.system import (
    ComparisonError,
    System,
    hold_to_same_samples,
    hold_together,
)
from mpmworlds.metrics import SCORED, Metric, Row, metric_named, summarise

SCHEMA: Final = "mpmworlds-gate/1"
FITTED_ON: Final = "modification_validation"
NAMES: Final = ("program", "fallback", "gate", "oracle_gate")
"""What is reported on: each system alone, the gate, and the better of both."""


def fit(program: System, fallback: System, metric: str) -> float:
    """Choose the threshold that makes the mean error of the continuation least.

    Parameters
    ----------
    program
        System whose candidates have scores of their prefixes.
    fallback
        System that answers instead, on the same samples.
    metric
        Name of a metric that `score` reports.

    Returns
    -------
    float
        tau: a midpoint between two prefix scores that follow each other, or an
        infinity. Of equally good ones that which keeps the most programs: a metric
        that saturates on prefixes then leaves the program as it is.

    Raises
    ------
    ComparisonError
        If a valid program has no score of its prefix.
    """
    judged = metric_named(metric)
    programs, fallbacks = program.chosen(metric), fallback.chosen(metric)
    scores = sorted(
        {
            _prefix_score(program, result, metric)
            for result in programs.values()
            if result.continuation is not None
        }
    )
    between = [(a + b) / 2 for a, b in pairwise(scores)]
    best: tuple[float, int, float] | None = None
    for tau in (-math.inf, *between, math.inf):
        kept = _kept(program, programs, judged, tau)
        # Exact sums: equal choices must tie, whatever the order of their terms.
        error = math.fsum(
            abs(_value(programs if keep else fallbacks, sample, judged) - judged.best)
            for sample, keep in kept.items()
        )
        if best is None or (error, -sum(kept.values())) < best[:2]:
            best = error, -sum(kept.values()), tau
    assert best is not None
    return best[2]


def gated(
    program: System, fallback: System, metric: str, tau: float
) -> tuple[list[Row], float]:
    """Rows of the gate with a threshold, and the share of samples it keeps programs on.

    A program that failed is never kept.
    """
    programs, fallbacks = program.chosen(metric), fallback.chosen(metric)
    kept = _kept(program, programs, metric_named(metric), tau)
    rows = [
        (programs if keep else fallbacks)[sample].row("gate")
        for sample, keep in kept.items()
    ]
    return rows, sum(kept.values()) / len(kept)


def gate_report(
    fitted: tuple[System, System], applied: tuple[System, System] | None = None
) -> dict[str, Any]:
    """Fit the gate of every metric, and apply it to another split.

    Parameters
    ----------
    fitted
        Program and fallback on `modification_validation`.
    applied
        The same two on another split, where tau is used as it was fitted.

    Returns
    -------
    dict
        JSON-serialisable: for each metric tau (`"-inf"` keeps the lowest scores out and
        `"inf"` lets all in where less is better, and the reverse), and for each split
        the share kept and the summaries of both systems alone, of the gate, and of the
        oracle gate, which takes the better of the two on each sample.

    Raises
    ------
    ComparisonError
        If the splits are others than these, or the results are not of the same
        predictors, regime, release, metrics and samples, or a prefix score is missing.
    """
    parts = {"fit": fitted} | ({"applied": applied} if applied else {})
    _hold_to_each_other(fitted, applied)
    metrics: dict[str, Any] = {}
    for metric in SCORED:
        tau = fit(*fitted, metric)
        metrics[metric] = {
            "direction": SCORED[metric].direction,
            "tau": tau if math.isfinite(tau) else str(tau),
            **{part: _outcome(*pair, metric, tau) for part, pair in parts.items()},
        }
    program, fallback = (system.provenance for system in fitted)
    return {
        "schema": SCHEMA,
        "program": asdict(program),
        "fallback": asdict(fallback),
        "splits": {part: pair[0].provenance.split for part, pair in parts.items()},
        "samples": {part: len(pair[0].samples) for part, pair in parts.items()},
        "metrics": metrics,
    }


def read_gate(
    fitted: Sequence[Path], applied: Sequence[Path] | None = None
) -> dict[str, Any]:
    """`gate_report` of folders of results, each time program and fallback."""
    pairs = [
        (System.read(folders[0]), System.read(folders[1]))
        for folders in (fitted, applied)
        if folders
    ]
    return gate_report(*pairs)


def gate_table(report: Mapping[str, Any]) -> str:
    """Write a report as tables for a terminal: means with failures at worst."""
    told = (report["program"], report["fallback"])
    who = " or else ".join(origin["predictor"] for origin in told)
    lines = [f"gate: {who}, {told[0]['regime']}, {told[0]['metrics_version']}"]
    for part, split in report["splits"].items():
        n = report["samples"][part]
        head = f"{part} on {told[0]['config']}/{split}, {n} samples, failures at worst"
        widths = (16, 6, 10, 7, *(13 for _ in NAMES))
        header = ("", "", "tau", "kept", *(name.replace("_", " ") for name in NAMES))
        lines += ["", head, _line(header, widths)]
        for metric, entry in report["metrics"].items():
            tau, found = entry["tau"], entry[part]
            means = [found[name]["failures_at_worst"]["mean"] for name in NAMES]
            cells = (
                *(metric, entry["direction"]),
                tau if isinstance(tau, str) else f"{tau:.4f}",
                f"{found['kept']:.1%}",
                *(f"{mean:.4f}" for mean in means),
            )
            lines.append(_line(cells, widths))
    return "\n".join(lines) + "\n"


def _line(cells: Sequence[str], widths: Sequence[int]) -> str:
    padded = (cell.ljust(width) for cell, width in zip(cells, widths, strict=True))
    return "".join(padded).rstrip()


def _outcome(
    program: System, fallback: System, metric: str, tau: float
) -> dict[str, Any]:
    judged = metric_named(metric)
    programs, fallbacks = program.chosen(metric), fallback.chosen(metric)
    better = [
        (fallbacks if _is_better(fallbacks, programs, sample, judged) else programs)[
            sample
        ].row("oracle_gate")
        for sample in programs
    ]
    rows, share = gated(program, fallback, metric, tau)
    for name, found in (("program", programs), ("fallback", fallbacks)):
        rows += [result.row(name) for result in found.values()]
    summaries = summarise([*rows, *better], metric)
    return {"kept": share} | {name: asdict(summaries[name]) for name in NAMES}


def _is_better(
    one: Mapping[str, Result], other: Mapping[str, Result], sample: str, metric: Metric
) -> bool:
    values = (_value(found, sample, metric) for found in (one, other))
    return metric.is_better(*values)


def _value(found: Mapping[str, Result], sample: str, metric: Metric) -> float:
    return found[sample].row("").value(metric.name)


def _kept(
    program: System, programs: Mapping[str, Result], metric: Metric, tau: float
) -> dict[str, bool]:
    """Whether each sample keeps its program; an infinite tau keeps all or none."""
    return {
        sample: result.continuation is not None
        and metric.is_better(_prefix_score(program, result, metric.name), tau)
        for sample, result in programs.items()
    }


def _prefix_score(program: System, result: Result, metric: str) -> float:
    if not result.prefix or metric not in result.prefix:
        raise ComparisonError(
            f"{program.folder}: {result.sample_id}, candidate {result.candidate}: no "
            f"{metric} of its prefix, which the gate goes by; evaluate a predictor "
            "that renders its prefix"
        )
    return result.prefix[metric]


def _hold_to_each_other(
    fitted: tuple[System, System], applied: tuple[System, System] | None
) -> None:
    for system in fitted:
        if system.provenance.split != FITTED_ON:
            raise ComparisonError(
                f"{system.folder}: of split {system.provenance.split!r}, a gate is "
                f"fitted on {FITTED_ON!r} alone"
            )
    splits = {system.provenance.split for system in applied or ()}
    if applied and (len(splits) > 1 or FITTED_ON in splits):
        raise ComparisonError(
            f"{applied[0].folder} and {applied[1].folder}: of splits {sorted(splits)}, "
            "a gate is applied to one other split than it is fitted on, e.g. 'test'"
        )
    hold_together([*fitted, *(applied or ())])
    for pair in (fitted, applied):
        if pair:
            hold_to_same_samples(pair, "evaluate both on the same samples")
    regimes = {s.provenance.regime for s in (*fitted, *(applied or ()))}
    if len(regimes) > 1:
        raise ComparisonError(
            f"{fitted[0].folder}: regimes {sorted(regimes)}, a gate is of one regime; "
            "evaluate both systems in it"
        )
    for one, other in zip(fitted, applied or (), strict=False):
        if one.provenance.predictor_sha256 != other.provenance.predictor_sha256:
            raise ComparisonError(
                f"{other.folder}: of another predictor, other options or source than "
                f"{one.folder}; apply the gate to the systems that it is fitted to"
            )
