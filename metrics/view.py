"""A clip with what several metrics need of it, each worked out once.

Clips of flat colours have few distinct ones: what a metric asks of a colour it then
asks once, and counts follow from one table. Noisy clips have up to as many as pixels;
they take the long way, to the same numbers.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property
from typing import Any, NamedTuple, TypeVar

import cv2
import numpy as np
import numpy.typing as npt

from mpmworlds.metrics.clips import Clip, Colours, Indices, Mask, check_clip
from mpmworlds.metrics.constants import CONSTANTS, Constants
from mpmworlds.metrics.tiles import tile_of_pixel

COLOURS = 1 << 24
LARGEST_TABLE = 4_000_000  # counts by frame, tile and colour
FEW = 500  # colours that are looked up as they come
Counts = npt.NDArray[np.int64]
V = TypeVar("V")


def some_above(frames: Iterable[cv2.typing.MatLike], level: int) -> Iterator[Mask]:
    """Tell where some channel of each frame, (H, W, 3), is above a level: (H * W,)."""
    channels: Sequence[cv2.typing.MatLike] | None = None
    for frame in frames:
        channels = cv2.split(frame, channels)  # into the same memory: 3 times faster
        red, green, blue = channels
        yield (cv2.max(cv2.max(red, green), blue) > level).ravel()


def true_in_each(masks: Mask) -> Counts:
    """Count what is true in each of several masks, (T, P): int64 (T,)."""
    # One after another: along an axis NumPy takes five times as long.
    return np.array([np.count_nonzero(mask) for mask in masks], np.int64)


class Foreground(NamedTuple):
    """The foreground pixels of a frame: where they are, and number of their colour."""

    place: Indices
    number: npt.NDArray[np.int32]


class View:
    """A clip as metrics look at it. They take one wherever they take a clip.

    A clip that is compared with several others is validated and counted once.

    Parameters
    ----------
    clip : uint8 array, shape (T, H, W, 3)
        Frames, RGB. It must not change while the view is used.
    subject : str
        What errors call it.
    constants : Constants
        Those of the definitions, unless other ones are to be tried.

    Raises
    ------
    ValueError
        If the array is no clip.
    """

    def __init__(
        self, clip: Clip, subject: str = "clip", constants: Constants = CONSTANTS
    ) -> None:
        check_clip(clip, subject)
        self.clip = np.ascontiguousarray(clip)
        self.constants = constants
        self._memo: dict[tuple[Any, ...], Any] = {}

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number, height and width of the frames."""
        count, height, width, _ = self.clip.shape
        return count, height, width

    def once(self, work: Callable[..., V], *beside: "View") -> V:
        """What a function makes of this view, and of others, called for them once."""
        key = work, *beside
        if key not in self._memo:
            self._memo[key] = work(self, *beside)
        found: V = self._memo[key]
        return found

    @cached_property
    def mask(self) -> Mask:
        """Foreground, `max(R, G, B) > 32`: bool (T, H * W)."""
        return np.stack(list(some_above(self.clip, self.constants.foreground_level)))

    @cached_property
    def sizes(self) -> Counts:
        """Foreground pixels of each frame: (T,)."""
        return true_in_each(self.mask)

    @cached_property
    def _pixels(self) -> tuple[Colours, list[Foreground]]:
        """The distinct colours of the foreground, ascending; its pixels by frame."""
        places = [np.flatnonzero(mask) for mask in self.mask]
        packed = [
            # OpenCV's BGRA, read as one number, is A << 24 | R << 16 | G << 8 | B.
            cv2.cvtColor(frame, cv2.COLOR_RGB2BGRA).view("<u4").ravel()[place]
            & np.uint32(COLOURS - 1)
            for frame, place in zip(self.clip, places, strict=True)
        ]
        colours, numbers = _numbered(packed)
        return colours, [
            Foreground(*pair) for pair in zip(places, numbers, strict=True)
        ]

    @property
    def colours(self) -> Colours:
        """Distinct colours of the foreground, ascending: (K,)."""
        return self._pixels[0]

    @property
    def foreground(self) -> list[Foreground]:
        """Foreground pixels of each frame; numbers count in `colours`."""
        return self._pixels[1]

    @cached_property
    def _table(self) -> Counts | None:
        """Pixels by frame, tile and colour, if that is no large table."""
        count, tiles = self.shape[0], self.constants.tiles_per_side**2
        if count * tiles * self.colours.size > LARGEST_TABLE:
            return None
        return self._counted(np.arange(self.colours.size), self.colours.size)

    def _counted(self, bins: Indices, count: int) -> Counts:
        side = self.constants.tiles_per_side
        tile = tile_of_pixel(*self.shape[1:], side).ravel() * count
        shape = side**2, count
        counts = np.empty((self.shape[0], *shape), np.int64)
        for found, (place, number) in zip(counts, self.foreground, strict=True):
            code = tile[place] + bins[number]
            found[:] = np.bincount(code, minlength=side**2 * count).reshape(shape)
        return counts

    def histogram(self, bins: Indices, count: int) -> Counts:
        """Count the foreground pixels of each frame and tile by bins of their colour.

        Parameters
        ----------
        bins : int array, shape (K,)
            Bin of each of `colours`.
        count : int
            Number of bins.

        Returns
        -------
        int64 array, shape (T, 16, count)
            The counts.
        """
        if self._table is None:
            return self._counted(bins, count)
        counts = np.zeros((*self._table.shape[:2], count), np.int64)
        for colour, number in enumerate(bins):
            counts[:, :, number] += self._table[:, :, colour]
        return counts

    def areas(self, chosen: npt.NDArray[np.bool_]) -> Counts:
        """Count the pixels of each frame whose colour is among chosen ones.

        Parameters
        ----------
        chosen : bool array, shape (N, K)
            For each of N choices, which of `colours` are among them.

        Returns
        -------
        int64 array, shape (N, T)
            The counts.
        """
        if self._table is not None:
            return np.asarray(chosen.astype(np.int64) @ self._table.sum(axis=1).T)
        return np.stack(
            [
                np.count_nonzero(chosen[:, number], axis=1)
                for _, number in self.foreground
            ],
            axis=1,
        )


def _numbered(frames: list[Colours]) -> tuple[Colours, list[npt.NDArray[np.int32]]]:
    """The distinct colours of frames, ascending, and their numbers in each frame."""
    number = np.zeros(COLOURS, np.int32)  # from 1; memory is taken where it is used
    known = np.zeros(0, np.uint32)
    for colours in frames:
        new = np.unique(colours[number[colours] == 0])
        known = np.concatenate([known, new])
        if known.size > FEW:
            seen = np.zeros(COLOURS, np.bool_)
            for every in frames:
                seen[every] = True
            known = np.flatnonzero(seen).astype(np.uint32)
            break
        number[new] = 1
    known.sort()
    number[known] = np.arange(known.size, dtype=np.int32)
    return known, [number[colours] for colours in frames]


def viewed(clip: Clip | View, subject: str) -> View:
    """Validate a clip, unless that has been done.

    Raises
    ------
    ValueError
        If it is no clip.
    """
    return clip if isinstance(clip, View) else View(clip, subject)


def compared(pred: Clip | View, ref: Clip | View) -> tuple[View, View]:
    """Validate two clips that are compared.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3), or View
        Prediction and reference, RGB.

    Raises
    ------
    ValueError
        If either is no clip, or if their shapes differ (the message names both).
    """
    one, other = viewed(pred, "prediction"), viewed(ref, "reference")
    if one.clip.shape != other.clip.shape:
        raise ValueError(
            f"prediction {one.clip.shape} and reference {other.clip.shape}: compared "
            "clips must have equal shapes; bring both to one size, frame rate and "
            "duration"
        )
    return one, other
