"""How far a prefix that a scene draws is from the one that is seen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from mpmworlds.baselines.search.perception.colors import Labels
from mpmworlds.metrics import wmae
from mpmworlds.metrics.clips import packed_colours
from mpmworlds.metrics.reduction import Frames
from mpmworlds.sim.scene.palette import rgb

COARSE: Final = 32  # side of the images in which near misses count less than far ones
EVERY: Final = 3  # frames between those that are compared so
WEIGHTS: Final = {"overlap": 0.4, "soft": 0.4, "motion": 0.2}


@dataclass(frozen=True)
class Losses:
    """How far what is drawn is off."""

    whole: float
    """Weighted mean, 0 to 1."""
    by_color: Mapping[str, float]
    """The same for each colour by itself, without the motion."""
    residual: npt.NDArray[np.float32] | None = None
    """Coarse differences, each colour's in parts of what is seen of it: small changes
    of a scene change them evenly. None if the scene cannot be run."""
    by_frame: Mapping[str, npt.NDArray[np.float64]] = field(default_factory=dict)
    """Overlap that each colour lacks, frame by frame; NaN where it is in neither."""

    def until(self, color: str, frames: int, missing: float) -> float:
        """Mean of what a colour lacks in the first frames, if it is in any of them."""
        lacks = self.by_frame.get(color, np.zeros(0))[:frames]
        known = lacks[~np.isnan(lacks)]
        return float(known.mean()) if len(known) else missing


class Reference:
    """The prefix, ready for comparisons.

    Parameters
    ----------
    labels
        Its frames.
    """

    def __init__(self, labels: Labels) -> None:
        self._numbers, self._colors = labels.numbers, labels.colors
        table = np.array([(0, 0, 0), *map(rgb, labels.colors)], np.uint8)
        self._frames: Frames = table[labels.numbers]
        self._codes = packed_colours(table)[1:]
        self._soft = [
            self._coarse(labels.numbers == k + 1) for k in range(len(labels.colors))
        ]
        self._norms = [max(float((a**2).sum()), 1e-6) ** 0.5 for a in self._soft]

    @property
    def frames(self) -> Frames:
        """The frames in colours of the palette, (T, N, N, 3)."""
        return self._frames

    def loss(self, drawn: Frames) -> float:
        """Weighted mean of lost overlap, coarse differences and missed motion, 0 to 1.

        Frames after the end of what is drawn do not count.
        """
        return self.losses(drawn).whole

    def losses(self, drawn: Frames) -> "Losses":
        """As `loss`, and for each colour without the motion."""
        count = min(len(drawn), len(self._frames))
        by_color, by_frame, overlaps, soft, residual = {}, {}, [], [], []
        codes = packed_colours(drawn[:count])
        for k, name in enumerate(self._colors):
            seen = self._numbers[:count] == k + 1
            shown = codes == self._codes[k]
            both = (seen & shown).sum(axis=(1, 2))
            any_ = (seen | shown).sum(axis=(1, 2))
            a, b = self._coarse(shown), self._soft[k][: -(-count // EVERY)]
            residual.append((a - b).ravel() / self._norms[k])
            if not any_.any():
                continue
            there = any_ > 0
            lacks = np.full(count, np.nan)
            lacks[there] = 1.0 - both[there] / any_[there]
            by_frame[name] = lacks
            overlaps.append(float(lacks[there].mean()))
            soft.append(float(np.abs(a - b).sum() / max((a + b).sum(), 1e-6)))
            by_color[name] = (
                WEIGHTS["overlap"] * overlaps[-1] + WEIGHTS["soft"] * soft[-1]
            )
        parts = {
            "overlap": float(np.mean(overlaps)) if overlaps else 1.0,
            "soft": float(np.mean(soft)) if soft else 1.0,
            "motion": float(wmae(drawn[:count], self._frames[:count])),
        }
        whole = sum(WEIGHTS[name] * value for name, value in parts.items())
        missed = np.concatenate(residual) if residual else None
        return Losses(whole, by_color, missed, by_frame)

    @staticmethod
    def _coarse(masks: npt.NDArray[np.bool_]) -> npt.NDArray[np.float32]:
        found: Sequence[npt.NDArray[np.float32]] = [
            cv2.GaussianBlur(
                cv2.resize(
                    mask.astype(np.float32),
                    (COARSE, COARSE),
                    interpolation=cv2.INTER_AREA,
                ),
                (0, 0),
                1.0,
            )
            for mask in masks[::EVERY]
        ]
        return np.stack(found)
