"""CPU seconds of all metrics of one pair, beside a plain version, in turns."""

import statistics
import time
from collections.abc import Callable, Sequence

import cv2
import numpy as np
from benchmarks.metrics import plain
from benchmarks.metrics.clips import Pair
from benchmarks.metrics.faults import delayed, noisy, recompressed

from mpmworlds.metrics import SCORED, View, score
from mpmworlds.metrics.clips import Clip

ROUNDS = 5


def seconds(function: Callable[[], object], rounds: int) -> float:
    """Median CPU time."""
    found = []
    for _ in range(rounds):
        start = time.process_time()
        function()
        found.append(time.process_time() - start)
    return statistics.median(found)


def predictions(pairs: Sequence[Pair]) -> dict[str, list[tuple[Clip, Clip]]]:
    """Kinds of predictions: name -> (prediction, reference) of each clip."""
    truths = [pair.truth for pair in pairs]
    others = [*truths[1:], truths[0]]
    return {
        "displaced run": [(pair.again, pair.truth) for pair in pairs],
        "delayed by 3 frames": [(delayed(t, 3), t) for t in truths],
        "another sample": list(zip(others, truths, strict=True)),
        "truth, H.264 4:2:0 crf 23": [(recompressed(t), t) for t in truths],
        "truth, noise sigma 8": [(noisy(t, 8.0), t) for t in truths],
        "delayed, noise sigma 8": [(noisy(delayed(t, 3), 8.0), t) for t in truths],
        "another sample, noise sigma 8": [
            (noisy(o, 8.0), t) for o, t in zip(others, truths, strict=True)
        ],
    }


def table(pairs: Sequence[Pair]) -> str:
    """Medians over clips and rounds; values are compared, too."""
    cv2.setNumThreads(1)
    lines = [
        f"{len(pairs)} clips of {pairs[0].truth.shape}, CPU seconds of one core",
        "",
        "| prediction | all metrics | worst clip | reference kept | plain | ratio |",
        "|---|---|---|---|---|---|",
    ]
    for name, cases in predictions(pairs).items():
        ours, kept, theirs = [], [], []
        for number, (pred, ref) in enumerate(cases):
            ours.append(seconds(lambda p=pred, r=ref: score(p, r), ROUNDS))
            view = View(ref)
            score(pred, view)
            kept.append(seconds(lambda p=pred, r=view: score(p, r), ROUNDS))
            if number == 0:  # it is slow
                theirs.append(seconds(lambda p=pred, r=ref: plain.score(p, r), 1))
                _compare(score(pred, ref), plain.score(pred, ref), name)
        mine, reference = statistics.median(ours), theirs[0]
        lines.append(
            f"| {name} | {mine:.3f} | {max(ours):.3f} | {statistics.median(kept):.3f} "
            f"| {reference:.2f} | {reference / mine:.0f} |"
        )
    lines += ["", *_apart(pairs)]
    return "\n".join(lines)


def _compare(ours: dict[str, float], theirs: dict[str, float], name: str) -> None:
    for metric, value in ours.items():
        if not np.isclose(value, theirs[metric], rtol=0.0, atol=1e-12):
            raise AssertionError(
                f"{name}: {metric} {value!r}, plain {theirs[metric]!r}"
            )


def _apart(pairs: Sequence[Pair]) -> list[str]:
    """Each metric alone, of a displaced run."""
    lines = ["| metric alone, displaced run | CPU seconds |", "|---|---|"]
    for name, metric in SCORED.items():
        times = [
            seconds(lambda p=pair, m=metric: m(p.again, p.truth), 3) for pair in pairs
        ]
        lines.append(f"| {name} | {statistics.median(times):.3f} |")
    return lines
