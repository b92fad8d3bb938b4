"""False alarms and misses of `collapse` and `anomaly`, by what is done to clips.

A collapse is false where no colour of the clean clip really loses half of its area; an
anomaly, in anything benign. A failure that is put into a clip is missed where the score
says nothing of it.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from benchmarks.metrics import faults
from benchmarks.metrics.clips import Pair

from mpmworlds.metrics import CONSTANTS, View, anomaly_excess, collapse
from mpmworlds.metrics.clips import Clip, packed_colours

SMALLEST = 25  # pixels of a colour in the first frame for its loss to be seen
SIZES = ((1000, 1 << 30), (300, 1000), (30, 300))  # of what pops out [px]
LOOKS: dict[str, Callable[[Clip], Clip]] = {
    "clean": lambda clip: clip,
    "noise sigma 3": lambda clip: faults.noisy(clip, 3.0),
    "noise sigma 8": lambda clip: faults.noisy(clip, 8.0),
    "H.264 4:2:0 crf 23": faults.recompressed,
    "H.264 4:2:0 crf 30": lambda clip: faults.recompressed(clip, 30),
}


class Found(NamedTuple):
    """How often, of how many, and the most extreme value."""

    hits: int
    total: int
    extreme: float

    def __str__(self) -> str:
        """As a cell of a table."""
        return f"{self.hits}/{self.total} ({self.extreme:.2f})" if self.total else "-"


def table(pairs: Sequence[Pair]) -> str:
    """Tables of both metrics, as Markdown."""
    return "\n".join(
        [f"{len(pairs)} clips", "", *_collapse(pairs), "", *_anomaly(pairs)]
    )


def real_loss(clip: Clip) -> float:
    """Largest share of its area that a colour of a clean clip really loses."""
    packed = packed_colours(clip)
    colours, counts = np.unique(packed[0], return_counts=True)
    losses = [0.0]
    for colour, first in zip(colours.tolist(), counts.tolist(), strict=True):
        if colour and first >= SMALLEST:
            areas = np.count_nonzero(packed == colour, axis=(1, 2))
            losses.append(1.0 - float(areas.min()) / first)
    return max(losses)


def _collapse(pairs: Sequence[Pair]) -> list[str]:
    lasting = [pair.truth for pair in pairs if real_loss(pair.truth) <= 0.5]
    erased = [bad for pair in pairs for bad in _erased(pair.truth)]
    lines = [
        "| collapse | false alarms (largest) | erased bodies missed (smallest) |",
        "|---|---|---|",
    ]
    for name, look in LOOKS.items():
        kept = [collapse(look(clip)) for clip in lasting]
        lost = [collapse(look(clip)) for clip in erased]
        alarms = Found(sum(v > 0.5 for v in kept), len(kept), max(kept, default=0.0))
        missed = Found(sum(v <= 0.5 for v in lost), len(lost), min(lost, default=1.0))
        lines.append(f"| {name} | {alarms} | {missed} |")
    return lines


def _erased(clip: Clip) -> list[Clip]:
    """Each colour that is there at first, gone from half time on."""
    packed, half = packed_colours(clip), len(clip) // 2
    colours, counts = np.unique(packed[0], return_counts=True)
    made = []
    for colour, first in zip(colours.tolist(), counts.tolist(), strict=True):
        if colour and first >= SMALLEST:
            bad = clip.copy()
            bad[half:][packed[half:] == colour] = 0
            made.append(bad)
    return made


def _anomaly(pairs: Sequence[Pair]) -> list[str]:
    lines = [
        "| anomaly | flagged | excess, median | extreme |",
        "|---|---|---|---|",
    ]
    views = [View(pair.truth) for pair in pairs]

    def row(name: str, cases: Sequence[tuple[Clip, View]], worst: bool) -> None:
        values = [anomaly_excess(clip, view) for clip, view in cases]
        if values:
            flagged = sum(v > CONSTANTS.anomaly_excess for v in values)
            extreme = max(values) if worst else min(values)
            lines.append(
                f"| {name} | {flagged}/{len(values)} | {np.median(values):.2f} "
                f"| {extreme:.2f} |"
            )

    both = list(zip(pairs, views, strict=True))
    row("benign: displaced run", [(p.again, v) for p, v in both], worst=True)
    for frames in (3, 15):
        late = [(faults.delayed(p.truth, frames), v) for p, v in both]
        row(f"benign: delayed by {frames} frames", late, worst=True)
    for name, look in list(LOOKS.items())[1:]:
        row(f"benign: {name}", [(look(p.truth), v) for p, v in both], worst=True)
        again = [(look(p.again), v) for p, v in both]
        row(f"benign: displaced run, {name}", again, worst=True)
    for low, high in SIZES:
        for name in ("clean", "H.264 4:2:0 crf 23", "noise sigma 8"):
            gone = [
                (LOOKS[name](bad), v)
                for p, v in both
                for area, bad in faults.popped_out(p.truth)
                if low <= area < high
            ]
            size = f"{low} px and more" if high > 1 << 20 else f"{low} to {high} px"
            row(f"body of {size} pops out, {name}", gone, worst=False)
    others = [*pairs[1:], pairs[0]]
    for name, made in {
        "every second frame black": [faults.every_second_black(p.truth) for p in pairs],
        "cut to another sample": [
            faults.cut_to(p.truth, o.truth) for p, o in zip(pairs, others, strict=True)
        ],
        "largest body recoloured": [faults.recoloured(p.truth) for p in pairs],
    }.items():
        row(name, list(zip(made, views, strict=True)), worst=False)
    return lines
