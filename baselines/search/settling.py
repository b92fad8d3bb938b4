"""What has settled stays where it was seen, though a scene draws it a little off.

A scene that was found leaves matter a few pixels from where it came to rest, for good.
Where such a thing barely moves at the end of the prefix, pixels keep what was seen in
the last frame until the scene changes them.
"""

from collections.abc import Collection
from typing import Final

import numpy as np
import numpy.typing as npt

from mpmworlds.baselines.search.perception.colors import Labels
from mpmworlds.metrics.reduction import Frames
from mpmworlds.sim.scene.palette import rgb
from mpmworlds.sim.scene.scene import Scene

LAST: Final = 5  # frames that tell whether a thing has settled
TRUSTED: Final = 0.7  # overlap at the end of the prefix of a thing that is drawn well
GONE: Final = 0.5  # overlap with itself of a thing that stays no longer

Mask = npt.NDArray[np.bool_]


def unrest(labels: Labels, color: str) -> float:
    """Part of a colour's area that changes from frame to frame at the end.

    It is infinite where the colour is not seen, or only in one frame.
    """
    masks = labels.masks(color)[-LAST:]
    both = (masks[1:] & masks[:-1]).sum(axis=(1, 2))
    any_ = (masks[1:] | masks[:-1]).sum(axis=(1, 2))
    if not len(any_) or not any_.all():
        return float("inf")
    return float((1.0 - both / any_).mean())


def matter_of(scene: Scene) -> set[str]:
    """Colours of bodies and of what is poured."""
    return {
        thing.visualization.color
        for thing in scene.objects
        if thing.object_type in ("dynamic_body", "emitter")
    }


def settled(labels: Labels, colors: Collection[str], still: float) -> list[str]:
    """Colours, of some that are of matter, that change by less than `still` a frame."""
    return [c for c in labels.colors if c in colors and unrest(labels, c) < still]


def carried(drawn: Frames, labels: Labels, colors: Collection[str]) -> Frames:
    """A continuation in which some colours go on from where they were seen.

    Parameters
    ----------
    drawn
        Frames of a scene, uint8 (T, N, N, 3): the prefix and what follows.
    labels
        The prefix that was seen.
    colors
        Colours that have settled in it.

    Returns
    -------
    ndarray
        The frames after the prefix. A pixel of such a colour keeps what was seen at the
        end of the prefix while it is drawn as it is drawn there; all of them do where
        the scene does not draw it near to where it is.
    """
    known = len(labels.numbers)
    continued = drawn[known:].copy()
    for color in colors:
        paint = np.array(rgb(color), np.uint8)
        seen = labels.masks(color)[-1]
        before: Mask = (drawn[known - 1] == paint).all(axis=2)
        lost = _overlap(before, seen) < TRUSTED
        for frame in continued:
            now: Mask = (frame == paint).all(axis=2)
            if not lost and _overlap(now, before) < GONE:
                continue
            wanted = seen if lost else np.where(now == before, seen, now)
            frame[now & ~wanted] = 0
            frame[wanted & ~frame.any(axis=2)] = paint
    return continued


def _overlap(one: Mask, other: Mask) -> float:
    return float((one & other).sum() / max((one | other).sum(), 1))
