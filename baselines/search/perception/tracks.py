"""Things by their colours: where each of them is in every frame."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from mpmworlds.baselines.search.perception.colors import Labels

Mask = npt.NDArray[np.bool_]

LEAST_PART: Final = 20  # pixels of a piece that is a thing of its own
WIDEST_GAP: Final = 40  # pixels of a thing in front of two pieces of one [px]
SAME: Final = 0.97  # overlap with itself of what stays


@dataclass(frozen=True, eq=False)
class Track:
    """One thing, or all that comes out of one nozzle."""

    color: str
    """Its colour."""
    masks: Mask
    """Where it is, (T, N, N)."""
    hidden: Mask
    """Where something else is seen, which it may lie behind, (T, N, N)."""
    first: int
    """First frame that shows it."""
    shared: bool = False
    """Whether other things have its colour."""

    @property
    def late(self) -> bool:
        """Whether the first frame does not show it: it comes out of a nozzle."""
        return self.first > 0

    @property
    def least_overlap(self) -> float:
        """Overlap with itself in the first frame, of the frame where it is least."""
        start = self.masks[0]
        worst = 1.0
        for mask, hidden in zip(self.masks[1:], self.hidden[1:], strict=True):
            care = ~hidden & ~self.hidden[0]
            both, any_ = (start & mask & care).sum(), ((start | mask) & care).sum()
            worst = min(worst, float(both / any_) if any_ else 1.0)
        return worst

    @property
    def stays(self) -> bool:
        """Whether nothing of it moves."""
        return not self.late and self.least_overlap > SAME

    def care(self, number: int) -> Mask:
        """Pixels of a frame that tell where it is."""
        telling: Mask = ~self.hidden[number]
        return telling


def tracks_of(labels: Labels) -> list[Track]:
    """Things of labelled frames, those of the first frame piece by piece."""
    return [track for color in labels.colors for track in _of_color(labels, color)]


def _of_color(labels: Labels, color: str) -> Iterator[Track]:
    masks = labels.masks(color)
    others = (labels.numbers > 0) & ~masks
    first = int(np.argmax(masks.any(axis=(1, 2))))
    pieces = _joined(_pieces(masks[0]), others[0]) if first == 0 else []
    if len(pieces) < 2:
        yield Track(color, masks, others, first)
        return
    for part, rest in _followed(masks, pieces):
        yield Track(color, part, others | rest, 0, shared=True)


def _pieces(mask: Mask) -> list[Mask]:
    count, numbers, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    large = [k for k in range(1, count) if stats[k, cv2.CC_STAT_AREA] >= LEAST_PART]
    return [numbers == k for k in large]


def _joined(pieces: list[Mask], hiding: Mask) -> list[Mask]:
    """Pieces with those behind one thing joined: all between them is of others."""
    found: list[Mask] = []
    for piece in pieces:
        whole = piece
        apart = []
        for other in found:
            if _only_hidden_between(other, piece, hiding):
                whole = whole | other
            else:
                apart.append(other)
        found = [*apart, whole]
    return found


def _only_hidden_between(one: Mask, other: Mask, hiding: Mask) -> bool:
    a, b = (np.argwhere(_edge(mask)) for mask in (one, other))
    squared = ((a[:, None] - b[None]) ** 2).sum(axis=2)
    i, j = np.unravel_index(squared.argmin(), squared.shape)
    steps = int(np.abs(a[i] - b[j]).max())
    if not 1 < steps <= WIDEST_GAP:
        return False
    line = np.rint(np.linspace(a[i], b[j], steps + 1)[1:-1]).astype(int)
    return bool(hiding[line[:, 0], line[:, 1]].all())


def _edge(mask: Mask) -> Mask:
    inner = cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    edge: Mask = mask & ~inner
    return edge


def _followed(masks: Mask, pieces: list[Mask]) -> list[tuple[Mask, Mask]]:
    """Each piece through all frames, with the rest: a pixel is of the nearest one."""
    parts = [np.zeros_like(masks) for _ in pieces]
    last = list(pieces)
    for number, mask in enumerate(masks):
        far = np.stack(
            [
                cv2.distanceTransform((~piece).astype(np.uint8), cv2.DIST_L2, 5)
                for piece in last
            ]
        )
        owner = far.argmin(axis=0)
        for k, part in enumerate(parts):
            part[number] = mask & (owner == k)
            if part[number].any():
                last[k] = part[number]
    return [(part, masks & ~part) for part in parts]
