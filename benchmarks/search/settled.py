"""How still a thing must be at the end of the prefix to stay where it was seen."""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np
from benchmarks.search.drawn import Pair, add_results, pairs

from mpmworlds.baselines.search.counting import write_prior
from mpmworlds.baselines.search.perception.colors import labels_of
from mpmworlds.baselines.search.prior import prior
from mpmworlds.baselines.search.settling import carried, matter_of, settled
from mpmworlds.metrics import score

GRID: Final = (0.0, 0.005, 0.01, 0.015, 0.02, 0.03, 0.04, 0.06, 0.08, 0.12, 1.0)
SHOWN: Final = ("mask_iou", "wmae", "collapse_excess")

Scores = Mapping[str, float]


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add of what."""
    add_results(parser)
    parser.add_argument(
        "--write", action="store_true", help="record it in the table of priors"
    )


def carry_out(options: argparse.Namespace) -> None:
    """Print scores for each threshold, and the one of the best overlap."""
    by_sample = {p.example.id: list(by_threshold(p)) for p in pairs(options)}
    print(f"| still | {' | '.join(SHOWN)} | samples that change |")
    print("|---" * (len(SHOWN) + 2) + "|")
    for place, still in enumerate(GRID):
        means = [_mean(by_sample, place, name) for name in SHOWN]
        changed = [n for n, all_ in by_sample.items() if all_[place] != all_[0]]
        cells = " | ".join(f"{value:.3f}" for value in means)
        print(f"| {still} | {cells} | {len(changed)} |")
    best = max(range(len(GRID)), key=lambda k: (_mean(by_sample, k, "mask_iou"), -k))
    print(f"best: still below {GRID[best]} of its area a frame")
    if options.write:
        write_prior({**vars(prior()), "still": GRID[best]})


def _mean(by_sample: Mapping[str, Sequence[Scores]], place: int, name: str) -> float:
    return float(np.mean([scores[place][name] for scores in by_sample.values()]))


def by_threshold(pair: Pair) -> Iterator[Scores]:
    """Scores of a continuation whose things stay below each threshold."""
    labels = labels_of(pair.example.prefix)
    drawn = pair.frames()
    known: dict[tuple[str, ...], Scores] = {}
    for still in GRID:
        colors = tuple(settled(labels, matter_of(pair.scene), still))
        if colors not in known:
            frames = carried(drawn, labels, colors)
            known[colors] = score(frames, pair.example.continuation)
        yield known[colors]
