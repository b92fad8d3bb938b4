"""What the truth scores with other seeds: what no prefix tells.

The seed of a scene moves particles about by a part of their distance. Who knows every
other number still draws it, so that no search does better on a row but by luck.
"""

import argparse
from collections.abc import Iterator, Sequence
from statistics import mean
from typing import Final

from benchmarks.search.drawn import Pair
from benchmarks.search.measure import COLUMNS
from benchmarks.search.rows import FINAL, SPLITS, all_ids, chosen_ids, examples

from mpmworlds.loaders.load import Example
from mpmworlds.metrics import score
from mpmworlds.sim.scene.scene import Scene

FIRST: Final = 7001  # seeds from here on; no row has any of them


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add which samples, and how many seeds."""
    parser.add_argument("--split", choices=sorted({*SPLITS, *FINAL}), default=SPLITS[0])
    parser.add_argument(
        "--final", action="store_true", help="all samples of the split, the test too"
    )
    parser.add_argument("--seeds", type=int, default=2, help="of each sample")


def carry_out(options: argparse.Namespace) -> None:
    """Print a row a sample, its means over the seeds."""
    rows = options.release, options.split, options.config
    ids = (all_ids if options.final else chosen_ids)(*rows)
    print("| row | " + " | ".join(COLUMNS) + " | mask_iou of each seed |")
    print("|---" * (len(COLUMNS) + 2) + "|")
    every: list[list[float]] = []
    for example in examples(*rows, ids, final=options.final):
        found = list(scores_of(example, options.seeds))
        every.append([mean(s[name] for s in found) for name in COLUMNS])
        each = ", ".join(f"{s['mask_iou']:.3f}" for s in found)
        print(_line(example.id, every[-1], each), flush=True)
    means = [mean(column) for column in zip(*every, strict=True)]
    print(_line(f"mean of {len(every)}", means, ""))


def scores_of(example: Example, seeds: int) -> Iterator[dict[str, float]]:
    """Scores of the true scene with other seeds, against the truth."""
    data = Scene.from_yaml(example.row["scene"], example.id).to_data()
    for seed in range(FIRST, FIRST + seeds):
        data["simulation"]["seed"] = seed
        scene = Scene.from_data(data)
        drawn = Pair(example, scene).frames()
        yield score(drawn[len(example.prefix) :], example.continuation)


def _line(name: str, values: Sequence[float], each: str) -> str:
    return f"| {name} | " + " | ".join(f"{v:.3f}" for v in values) + f" | {each} |"
