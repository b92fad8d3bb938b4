"""Scores of search on the samples of development, beside copy_last and the ceiling."""

import argparse
import statistics
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from benchmarks.search.rows import SPLITS, chosen_ids, examples

from mpmworlds.baselines.evaluate import evaluate_examples
from mpmworlds.baselines.protocol import AnyPredictor
from mpmworlds.baselines.provenance import Provenance
from mpmworlds.baselines.registry import predictor_named
from mpmworlds.baselines.results import RESULTS, Result, read_results
from mpmworlds.baselines.scoring import HOW
from mpmworlds.baselines.search.infer import Budget
from mpmworlds.loaders.load import Example
from mpmworlds.loaders.regimes import DEFAULT, REGIMES

COLUMNS: Final = ("mask_iou", "wmae", "color_tv", "collapse_excess", "anomaly")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what is measured."""
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--regime", default=DEFAULT, choices=sorted(REGIMES))
    parser.add_argument("--runs", type=int, default=Budget.runs)
    parser.add_argument("--minutes", type=float, default=Budget.minutes)
    parser.add_argument("--candidates", type=int, default=1)
    parser.add_argument("--split", choices=SPLITS, help="only this one")


def carry_out(options: argparse.Namespace) -> None:
    """Evaluate, sample by sample in this process, and print the table."""
    told = {name: getattr(options, name) for name in ("runs", "minutes", "candidates")}
    splits = [options.split] if options.split else list(SPLITS)
    both = []
    for name, made_with in (("search", told), ("copy_last", {})):
        for split in splits:
            start = time.monotonic()
            count = _evaluate(options, name, made_with, split)
            seconds = (time.monotonic() - start) / count
            print(f"{name}, {split}: {seconds:.0f} s a sample, if none was there")
        both.append(read_all(options.out / name, splits))
    print("\n".join(table(*both)))


def _evaluate(
    options: argparse.Namespace, name: str, made_with: Mapping[str, Any], split: str
) -> int:
    """Evaluate on the samples of a split; returns how many."""
    ids = chosen_ids(options.release, split, options.config)
    chosen = examples(options.release, split, options.config, ids, options.regime)
    folder = options.out / name / split
    predictor = predictor_named(name, made_with)
    evaluate_on(options, split, chosen, predictor, made_with, folder)
    return len(ids)


def evaluate_on(
    options: argparse.Namespace,
    split: str,
    chosen: Sequence[Example],
    predictor: AnyPredictor,
    made_with: Mapping[str, Any],
    folder: Path,
) -> None:
    """Evaluate on some samples, as `mpmworlds evaluate` does."""
    provenance = Provenance.of(
        options.release,
        predictor,
        options.config,
        split,
        options.regime,
        options=made_with,
    )
    evaluate_examples(chosen, predictor, provenance, folder, how=HOW)


def read_all(folder: Path, splits: Sequence[str]) -> dict[str, Result]:
    """Best candidate, by the overlap of its prefix, of each sample of all splits."""
    best: dict[str, Result] = {}
    for split in splits:
        for result in read_results(folder / split / RESULTS)[1]:
            rival = best.get(result.sample_id)
            if rival is None or _merit(result) > _merit(rival):
                best[result.sample_id] = result
    return best


def _merit(result: Result) -> float:
    if result.continuation is None:
        return -1.0
    return (result.prefix or {}).get("mask_iou", 0.0)


def table(search: Mapping[str, Result], copied: Mapping[str, Result]) -> Iterator[str]:
    """Lines of a Markdown table: search / copy_last (ceiling), and means."""
    yield f"| row | {' | '.join(COLUMNS)} |"
    yield "|---" * (1 + len(COLUMNS)) + "|"
    for name, result in search.items():
        cells = [_cell(result, copied[name], column) for column in COLUMNS]
        yield f"| {name} | {' | '.join(cells)} |"
    means = [
        " / ".join(
            f"{_mean([r.continuation for r in results.values()], column):.3f}"
            for results in (search, copied)
        )
        for column in COLUMNS
    ]
    yield f"| mean of {len(search)} | {' | '.join(means)} |"


def _cell(result: Result, copied: Result, column: str) -> str:
    one, other = ((r.continuation or {}).get(column) for r in (result, copied))
    ceiling = (result.ceiling or {}).get(column)
    cell = f"{result.outcome}" if one is None else f"{one:.3f}"
    cell += "" if other is None else f" / {other:.3f}"
    return cell if ceiling is None else f"{cell} ({ceiling:.3f})"


def _mean(scores: Sequence[Mapping[str, float] | None], column: str) -> float:
    there = [one[column] for one in scores if one is not None]
    return statistics.fmean(there) if there else float("nan")
