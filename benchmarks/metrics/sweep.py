"""What other constants do to the means of simple predictions, and to their order."""

import itertools
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from benchmarks.metrics.clips import Pair
from benchmarks.metrics.faults import delayed, recompressed

from mpmworlds.metrics import CONSTANTS, METRICS, View
from mpmworlds.metrics.clips import Clip
from mpmworlds.metrics.constants import Constants

OTHERS: dict[str, tuple[Any, ...]] = {
    "foreground_level": (16, 64),
    "tiles_per_side": (2, 8),
    "collapse_bins": (8, 32),
    "collapse_min_region_px": (9, 100),
    "collapse_min_core_px": (1, 25),
    "collapse_area_chromaticity": (0.03, 0.1),
    "collapse_area_brightness": (0.15, 0.4),
    "wmae_dead_band": (8, 16, 32),
    "wmae_window": (1, 4, 16),
    "color_tv_bins": (4, 16),
    "anomaly_windows": ((1,), (3,), (1, 3, 6)),
    "anomaly_local_px": (32, 128),
    "anomaly_colour_px": (100, 400),
    "anomaly_slack": (2, 8),
    "anomaly_excess": (0.45, 0.65),
    "semd_directions": (4, 8, 32),
}
Means = dict[str, dict[str, float]]  # by prediction, by metric


def predictions(pairs: Sequence[Pair]) -> dict[str, list[Clip]]:
    """Simple predictions of each clip."""
    truths = [pair.truth for pair in pairs]
    return {
        "displaced run": [pair.again for pair in pairs],
        "truth, crf 23": [recompressed(truth) for truth in truths],
        "delayed by 3": [delayed(truth, 3) for truth in truths],
        "first frame": [np.repeat(t[:1], len(t), axis=0) for t in truths],
        "reversed": [truth[::-1] for truth in truths],
        "another sample": [*truths[1:], truths[0]],
        "black": [np.zeros_like(truth) for truth in truths],
    }


def touched(constant: str) -> list[str]:
    """Names of the metrics that a constant may change: by its name, else all."""
    own = [name for name in METRICS if constant.startswith(f"{name}_")]
    return own or list(METRICS)


def means(
    made: dict[str, list[Clip]],
    pairs: Sequence[Pair],
    constants: Constants,
    names: Sequence[str],
) -> Means:
    """Mean of some metrics for each prediction."""
    references = [View(pair.truth, constants=constants) for pair in pairs]
    found: Means = {}
    for made_by, clips in made.items():
        views = [View(clip, constants=constants) for clip in clips]
        found[made_by] = {
            name: float(
                np.mean(
                    [
                        METRICS[name](v, r)
                        for v, r in zip(views, references, strict=True)
                    ]
                )
            )
            for name in names
        }
    return found


def table(pairs: Sequence[Pair]) -> str:
    """For each other value: pairs of predictions that change places, and how far."""
    made = predictions(pairs)
    names = list(METRICS)
    usual = means(made, pairs, CONSTANTS, names)
    lines = [
        f"{len(pairs)} clips; means",
        "",
        f"| prediction | {' | '.join(names)} |",
        "|---|" + "---|" * len(names),
        *(
            f"| {name} | {' | '.join(f'{row[n]:.3f}' for n in names)} |"
            for name, row in usual.items()
        ),
        "",
        "| constant | value | largest change of a mean | pairs that change places |",
        "|---|---|---|---|",
    ]
    for constant, values in OTHERS.items():
        seen = touched(constant)
        for value in values:
            other = means(made, pairs, replace(CONSTANTS, **{constant: value}), seen)
            change, metric, name = max(
                (abs(other[p][m] - usual[p][m]), m, p) for p in made for m in seen
            )
            swapped = [
                f"{m}: {a} / {b}"
                for m in seen
                for a, b in itertools.combinations(made, 2)
                if (usual[a][m] - usual[b][m]) * (other[a][m] - other[b][m]) < 0
            ]
            where = f"{metric} of {name}" if change else "-"
            lines.append(
                f"| {constant} | {value} | {change:.3f} ({where}) "
                f"| {'; '.join(swapped) or 'none'} |"
            )
    return "\n".join(lines)
