"""Where pixels are, and which of them a shape covers, exactly as frames are drawn."""

from dataclasses import dataclass
from typing import Any, Final

import cv2
import numpy as np
import numpy.typing as npt

from mpmworlds.sim.scene.objects import SHAPES

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Data = dict[str, Any]

WALL: Final = 6.0 / 128  # thickness of walls [m]
GROWN: Final = 0.22 / 256  # bodies are drawn by so much larger, all around [m]
_SHARP: Final = 0.3  # of a pixel: how soon the fit of an edge forgives [px]


@dataclass(frozen=True)
class Pixels:
    """The pixels of a square clip.

    A clip of 256 px that was drawn at 512 px holds every second pixel of it, which lies
    at three quarters of a pixel, not in the middle.
    """

    side: int
    """Pixels per side."""
    middle: float
    """Place of the sampled point in a pixel, from its left and upper edge."""

    @classmethod
    def of(cls, side: int, drawn: int) -> "Pixels":
        """Those of a reduced clip, from pixels per side as it was drawn."""
        picked = (2 * np.arange(2) + 1) * drawn // (2 * side)
        return cls(side, float((picked[0] + 0.5) * side / drawn))

    def centers(self) -> tuple[Floats, Floats]:
        """Coordinates x (N,) of columns and y (N,) of rows [m]."""
        along = (np.arange(self.side) + self.middle) / self.side
        return along, 1.0 - along

    def places(self, rows: Any, columns: Any) -> Floats:
        """Coordinates (n, 2) [m] of pixels."""
        x = (np.asarray(columns, float) + self.middle) / self.side
        y = 1.0 - (np.asarray(rows, float) + self.middle) / self.side
        return np.stack([x, y], axis=-1)

    def centroid(self, mask: Mask) -> Floats:
        """Middle (2,) of the pixels of a mask [m]."""
        rows, columns = np.nonzero(mask)
        found: Floats = self.places(rows, columns).mean(axis=0)
        return found

    def area(self, mask: Mask) -> float:
        """Area of a mask [m^2]."""
        return float(mask.sum()) / self.side**2

    def window(self, mask: Mask, margin: int) -> tuple[slice, slice]:
        """Rows and columns around a mask."""
        rows, columns = np.nonzero(mask)
        return tuple(
            slice(max(int(k.min()) - margin, 0), int(k.max()) + margin + 1)
            for k in (rows, columns)
        )  # type: ignore[return-value]


def rotation(turn: float) -> Floats:
    """Matrix (2, 2) of a turn [rad]."""
    cos, sin = np.cos(turn), np.sin(turn)
    return np.array([[cos, -sin], [sin, cos]])


def rim(side: int, width: float) -> Mask:
    """Pixels (side, side) at most so far from the edge of the domain [m]."""
    edge = round(width * side)
    found: Mask = np.ones((side, side), np.bool_)
    found[edge : side - edge, edge : side - edge] = False
    return found


def around(mask: Mask, reach: int) -> Mask:
    """Pixels (N, N) at most so many rows and columns from those of a mask."""
    kernel = np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)
    found: Mask = cv2.dilate(mask.astype(np.uint8), kernel) > 0
    return found


def distances(shape: Data, x: Floats, y: Floats) -> Floats:
    """Signed distances [m] of points from a shape in plain data."""
    model = SHAPES[shape["type"]].model_validate(shape)
    angle = model.angle()
    dx, dy = x - shape["center"][0], y - shape["center"][1]
    cos, sin = np.cos(angle), np.sin(angle)
    return model.distance(cos * dx + sin * dy, cos * dy - sin * dx)


def covered(shape: Data, pixels: Pixels, grown: float = 0.0) -> Mask:
    """Pixels (N, N) that a shape covers."""
    x, y = pixels.centers()
    found: Mask = distances(shape, x[None, :], y[:, None]) < grown
    return found


class Field:
    """Distances from a shape, looked up: as quick for any shape.

    Parameters
    ----------
    shape
        Plain data.
    """

    STEP: Final = 1.0 / 512  # between points of the table [m]
    BEYOND: Final = 0.06  # how far the table goes beyond the shape [m]

    def __init__(self, shape: Data) -> None:
        model = SHAPES[shape["type"]].model_validate(shape)
        self.reach = model.reach()
        self._angle, self._center = model.angle(), shape["center"]
        count = int(np.ceil((self.reach + self.BEYOND) / self.STEP))
        self._middle = float(count)
        along = np.arange(-count, count + 1) * self.STEP
        x, y = np.meshgrid(along, along)
        self._table = np.asarray(model.distance(x, y), np.float32)

    def distances(
        self, x: Floats, y: Floats, shift: tuple[float, float], turn: float
    ) -> Floats:
        """Signed distances [m] of points (n,) from the displaced shape."""
        dx = x - (self._center[0] + shift[0])
        dy = y - (self._center[1] + shift[1])
        cos, sin = np.cos(self._angle + turn), np.sin(self._angle + turn)
        columns = (cos * dx + sin * dy) / self.STEP + self._middle
        rows = (cos * dy - sin * dx) / self.STEP + self._middle
        columns, rows = (
            np.pad(k, (0, -len(k) % 256)).reshape(-1, 256).astype(np.float32)
            for k in (columns, rows)
        )  # remap takes no long lines
        found = cv2.remap(
            self._table,
            columns,
            rows,
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )
        return found.ravel()[: len(x)].astype(np.float64)


class Seen:
    """A mask that shapes are compared with, near to where it is.

    Parameters
    ----------
    mask
        Pixels of a thing.
    care
        Pixels that tell anything; all if None.
    pixels
        Where they are.
    margin
        How far around the mask pixels count [px].
    """

    def __init__(
        self, mask: Mask, care: Mask | None, pixels: Pixels, margin: int = 10
    ) -> None:
        rows, columns = pixels.window(mask, margin)
        x, y = pixels.centers()
        near = mask[rows, columns]
        telling = np.ones_like(near) if care is None else care[rows, columns] | near
        across, along = np.meshgrid(x[columns], y[rows])
        self._x, self._y = across[telling], along[telling]
        self._mask = near[telling]
        self._sign = np.where(self._mask, 1.0, -1.0)
        self._scale = _SHARP / pixels.side
        self._total = max(float(self._mask.sum()), 1.0)

    def misfit(self, shape: Data, grown: float = 0.0) -> float:
        """Logistic loss of a shape: smooth in its numbers, least where edges agree."""
        return self._misfit(distances(shape, self._x, self._y) - grown)

    def iou(self, shape: Data, grown: float = 0.0) -> float:
        """Overlap of a shape with the mask, of pixels that tell anything."""
        return self._iou(distances(shape, self._x, self._y) < grown)

    def misfit_at(self, field: Field, pose: Floats, grown: float = 0.0) -> float:
        """As `misfit`, of a shape that is displaced: (x, y, turn)."""
        return self._misfit(self._displaced(field, pose) - grown)

    def iou_at(self, field: Field, pose: Floats, grown: float = 0.0) -> float:
        """As `iou`, of a shape that is displaced."""
        return self._iou(self._displaced(field, pose) < grown)

    def _displaced(self, field: Field, pose: Floats) -> Floats:
        x, y, turn = (float(v) for v in pose)
        return field.distances(self._x, self._y, (x, y), turn)

    def _misfit(self, d: Floats) -> float:
        wrong = np.clip(self._sign * d / self._scale, -30.0, 60.0)
        return float(np.log1p(np.exp(wrong)).sum()) / self._total

    def _iou(self, inside: Mask) -> float:
        mask = self._mask
        return float((inside & mask).sum() / max((inside | mask).sum(), 1))
