"""Frames of any size on the canvas that a model takes, and back."""

from dataclasses import dataclass

import cv2
import numpy as np

from mpmworlds.metrics.reduction import Frames


@dataclass(frozen=True)
class Canvas:
    """How frames are fitted.

    Without a size, the last row and column are repeated until the sides are multiples:
    no pixel of a frame is changed, and what is added is cut off again.
    """

    height: int
    """Of the frames. [px]"""
    width: int
    """Of the frames. [px]"""
    multiple: int
    """What the sides of the canvas are a multiple of. [px]"""
    size: int | None = None
    """Length of the shorter side that frames are resized to first; as they are if None.
    [px]"""

    def __post_init__(self) -> None:
        """Refuse a size that would be padded as well."""
        if self.size is not None and (self.size < 1 or self.size % self.multiple):
            near = max(round(self.size / self.multiple), 1) * self.multiple
            raise ValueError(
                f"size = {self.size} px, must be a multiple of {self.multiple}, as "
                f"{near} is"
            )

    @property
    def resized(self) -> tuple[int, int]:
        """Height and width of the frames after resizing [px]."""
        if self.size is None:
            return self.height, self.width
        scale = self.size / min(self.height, self.width)
        return round(self.height * scale), round(self.width * scale)

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the canvas [px]."""
        height, width = (
            -(-side // self.multiple) * self.multiple for side in self.resized
        )
        return height, width

    def put(self, frames: Frames) -> Frames:
        """Frames (T, height, width, 3) as (T, *shape, 3)."""
        resized = _resize(frames, self.resized)
        down, right = np.subtract(self.shape, self.resized)
        return np.pad(resized, ((0, 0), (0, down), (0, right), (0, 0)), mode="edge")

    def take(self, frames: Frames) -> Frames:
        """Frames (T, *shape, 3) as (T, height, width, 3)."""
        height, width = self.resized
        return _resize(frames[:, :height, :width], (self.height, self.width))


def _resize(frames: Frames, shape: tuple[int, int]) -> Frames:
    """Larger by repeating pixels, smaller by means: whole factors come back exactly."""
    if frames.shape[1:3] == shape:
        return frames
    larger = shape[0] > frames.shape[1]
    method = cv2.INTER_NEAREST_EXACT if larger else cv2.INTER_AREA
    size = shape[::-1]
    return np.stack([cv2.resize(one, size, interpolation=method) for one in frames])
