"""How a shape moves without changing: its displacement and turn in every frame."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from mpmworlds.baselines.search.perception.pixels import (
    WALL,
    Data,
    Field,
    Pixels,
    Seen,
    around,
    rim,
)
from mpmworlds.baselines.search.perception.simplex import descend
from mpmworlds.baselines.search.perception.tracks import Track

Floats = npt.NDArray[np.float64]

LOST: Final = 0.6  # overlap below which a shape is not followed any further
ROUND: Final = ("circle",)
REACH: Final = 4  # pixels within which things push each other: two cells of the grid
FIRST_TURNS: Final = (-0.4, -0.2, -0.08, 0.08, 0.2, 0.4)  # per frame [rad]


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of a thing from the first frame on, as far as it was followed."""

    shift: Floats
    """Displacement of the center, (n, 2) [m]."""
    turn: Floats
    """Turn about the center, (n,) [rad]."""
    iou: Floats
    """Overlap of the displaced shape with what is seen, (n,)."""
    clear: int
    """Number of first frames in which nothing is near that might push it."""

    def __len__(self) -> int:
        return len(self.turn)

    def rigid(self, least: float) -> int:
        """Number of first frames that all overlap by `least`."""
        below = np.nonzero(self.iou < least)[0]
        return int(below[0]) if len(below) else len(self)


def poses_of(track: Track, shape: Data, pixels: Pixels, grown: float = 0.0) -> Poses:
    """Follow a shape through the frames of its track.

    Parameters
    ----------
    track
        Where its pixels are.
    shape
        What it is in the first frame, plain data.
    pixels
        Where they lie.
    grown
        By how much it is drawn larger than it is [m].
    """
    found = [np.zeros(3)]
    ious = [1.0]
    closed = shape["type"] == "ring" and not shape.get("opening_deg")
    slides = shape["type"] in ROUND or closed
    velocity = np.zeros(3)
    field = Field(shape)
    for number in range(1, len(track.masks)):
        if track.masks[number].sum() < 12:
            break
        seen = Seen(track.masks[number], track.care(number), pixels, margin=14)
        last = found[-1]
        moved = pixels.centroid(track.masks[number]) - pixels.centroid(track.masks[0])
        guesses = [last + velocity, last, np.array([*moved, last[2] + velocity[2]])]
        if number < 3 and not slides:
            guesses += [last + [0.0, 0.0, turn] for turn in FIRST_TURNS]
            guesses += [np.array([*moved, last[2] + turn]) for turn in FIRST_TURNS]

        def cost(x: Floats, seen: Seen = seen) -> float:
            return seen.misfit_at(field, x, grown)

        start = min(guesses, key=cost)
        step = 1.0 / pixels.side
        if slides:
            _, x = descend(
                lambda v: cost(np.array([*v, 0.0])), start[:2], [step, step], 45
            )
            pose = np.array([*x, 0.0])
        else:
            _, pose = descend(cost, start, [step, step, 0.04], 80)
        velocity = pose - last
        found.append(pose)
        ious.append(seen.iou_at(field, pose, grown))
        if ious[-1] < LOST:
            break
    all_ = np.array(found)
    return Poses(all_[:, :2], all_[:, 2], np.array(ious), _clear(track, len(all_)))


def _clear(track: Track, count: int) -> int:
    """First frames, at most `count`, in which nothing is near to a thing."""
    walls = rim(track.masks.shape[1], WALL)
    for number in range(count):
        near = around(track.masks[number], REACH)
        if (near & (track.hidden[number] | walls)).any():
            return number
    return count
