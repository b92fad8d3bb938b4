"""Results -> the summary that is published, and its table."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from mpmworlds.baselines.provenance import Provenance
from mpmworlds.baselines.results import PASSED_OVER, Result
from mpmworlds.baselines.slices import parts
from mpmworlds.metrics import (
    SCORED,
    Interval,
    Row,
    best_of_n,
    definition,
    oracle_of_n,
    random_of_n,
    summarise,
)

SCHEMA: Final = "mpmworlds-summary/1"
HORIZONS: Final = 3  # equal parts of the continuation
NO_TROUBLES: Final[Mapping[str, str]] = MappingProxyType({})


def summarise_results(
    provenance: Provenance,
    results: Sequence[Result],
    expected: int | None = None,
    troubles: Mapping[str, str] = NO_TROUBLES,
) -> dict[str, Any]:
    """Summarise the results of one evaluation.

    With several candidates per sample, each metric selects one by its value on the
    prefix and is then taken on that candidate's continuation.

    Parameters
    ----------
    provenance
        What the results have in common.
    results
        All candidates of all samples, failures included.
    expected
        How many samples there should be; as many as there are if None.
    troubles
        Samples of which nothing could be said, and why.

    Returns
    -------
    dict
        JSON-serialisable, and a function of the results alone: no times, no paths.

    Raises
    ------
    ValueError
        If a result lacks a metric.
    """
    samples = len({result.sample_id for result in results})
    summary: dict[str, Any] = {
        "schema": SCHEMA,
        "provenance": asdict(provenance),
        "definition": definition(),
        "expected": samples if expected is None else expected,
        "samples": samples,
        "troubles": dict(sorted(troubles.items())),
        "candidates": len(results),
        "outcomes": dict(sorted(Counter(r.outcome for r in results).items())),
        "continuation": _metrics(results),
    }
    if all(result.prefix for result in results if result.outcome == "ok"):
        summary["prefix"] = _metrics(results, of_prefix=True)
    if len(results) > samples and PASSED_OVER not in summary["outcomes"]:
        summary["choices"] = {
            "random": _metrics(results, choose=random_of_n),
            "oracle": _metrics(results, choose=oracle_of_n),
        }
    summary["slices"] = {
        name: {part: _metrics(members) for part, members in table.items()}
        for name, table in parts(results).items()
    }
    summary["slices"]["horizon"] = {
        f"{k + 1}/{HORIZONS}": _metrics([_in_horizon(r, k) for r in results])
        for k in range(HORIZONS)
    }
    return summary


def _in_horizon(result: Result, part: int) -> Result:
    """The result of one part of the continuation: the means of its curves there."""
    if result.curves is None or min(map(len, result.curves.values())) < HORIZONS:
        return result
    means = {
        name: float(np.array_split(np.array(curve), HORIZONS)[part].mean())
        for name, curve in result.curves.items()
    }
    return replace(result, continuation=means)


def _metrics(
    results: Sequence[Result],
    *,
    of_prefix: bool = False,
    choose: Callable[[Iterable[Row], str], list[Row]] | None = None,
) -> dict[str, Any]:
    """Return, per metric, its direction and the two summaries of one system."""
    table: dict[str, Any] = {}
    if not results:
        return table
    for name, metric in SCORED.items():
        rows = (
            choose([result.row("") for result in results], name)
            if choose
            else _selected(results, name, of_prefix)
        )
        (summary,) = summarise(rows, name).values()
        table[name] = {
            "direction": metric.direction,
            "valid": asdict(summary.valid),
            "failures_at_worst": asdict(summary.failures_at_worst),
        }
    return table


def _selected(results: Sequence[Result], metric: str, of_prefix: bool) -> list[Row]:
    """Return one row per sample, chosen by its prefix where there is a choice."""
    scored = [result.row("", of_prefix=of_prefix) for result in results]
    if all(result.candidates == 1 for result in results):
        return scored
    ranked = [result.row("", of_prefix=True) for result in results]
    return best_of_n(ranked, scored, metric)


def summary_table(summary: dict[str, Any]) -> str:
    """Write a summary as a table for a terminal.

    Parameters
    ----------
    summary
        What `summarise_results` returned, or its JSON read back.

    Returns
    -------
    str
        One line per metric: mean +- standard error, 95 % interval and number of
        samples, over the valid samples and with failures at the worst value.
    """
    origin = summary["provenance"]
    outcomes = ", ".join(f"{n} {name}" for name, n in summary["outcomes"].items())
    where = f"{origin['config']}/{origin['split']}, {origin['regime']}"
    who = origin["predictor"] + " (knows the answers)" * origin["knows_answers"]
    lines = [
        f"{who} on {where}, {origin['metrics_version']}",
        f"{summary['samples']} samples, {summary['candidates']} candidates: {outcomes}",
    ]
    if missing := summary["expected"] - summary["samples"]:
        reasons = "; ".join(f"{k}: {v}" for k, v in summary["troubles"].items())
        told = f" ({reasons})" if reasons else ""
        noun = "sample is" if missing == 1 else "samples are"
        lines.append(f"INCOMPLETE: {missing} {noun} missing{told}")
    for part in ("continuation", "prefix"):
        if part in summary:
            lines += ["", *_table(part, summary[part])]
    return "\n".join(lines) + "\n"


def _table(title: str, metrics: dict[str, Any]) -> list[str]:
    header = (title, "", "valid only", "95 %", "n", "failures worst", "95 %", "n")
    rows = [header]
    for name, entry in metrics.items():
        cells = [name, entry["direction"]]
        for kind in ("valid", "failures_at_worst"):
            cells += _cells(Interval(**entry[kind]))
        rows.append(tuple(cells))
    widths = [max(len(row[k]) for row in rows) for k in range(len(header))]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        for row in rows
    ]
    return [line.rstrip() for line in lines]


def _cells(interval: Interval) -> tuple[str, str, str]:
    mean = "-" if interval.mean is None else f"{interval.mean:.4f}"
    if interval.sem is not None:
        mean += f" +- {interval.sem:.4f}"
    bounds = "-"
    if interval.low is not None and interval.high is not None:
        bounds = f"[{interval.low:.4f}, {interval.high:.4f}]"
    return mean, bounds, str(interval.n)
