"""What a nozzle would show before anything is hit: its particles in free flight."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import cv2
import numpy as np
import numpy.typing as npt

from mpmworlds.baselines.search.perception.pixels import (
    WALL,
    Pixels,
    around,
    rim,
)
from mpmworlds.sim.scene.objects import EMISSIONS

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Data = dict[str, Any]

SPACING: Final = 1.0 / 256  # of particles at rest: 128 cells, 4 particles a cell [m]
BALL: Final = 2.3  # radius of what a particle covers, in spacings
COVERS: Final = 0.4 * math.pi * BALL**2 / 3
SCALES: Final = ((1, 0.7, 1.0), (2, 1.0, 24.0), (4, 1.5, 480.0))
"""Of comparison: reduction of the image, blur after it [px], and weight."""
USUAL: Final = 0.85  # rate of jets over the densest, in the middle of many
DENSEST: Final = 1.2  # of particles at rest; few of the train split are denser
UNUSUAL: Final = 0.15  # misfit that a rate far from it is worth, per squared log
MARGIN: Final = 24  # pixels around what is seen
REBOUND: Final = 0.12  # height above the first contact that nothing rebounds to [m]
STRIPS: Final = 96  # along gravity, of a width of 3 m
BESIDE: Final = 3  # strips to either side of a contact that are spoiled, too
CLEAR: Final = 7  # pixels from other things within which nothing is told


@dataclass(frozen=True, eq=False)
class Hit:
    """Contacts of what leaves a nozzle: beneath them, nothing flies freely."""

    frame: int
    """Last frame before the first of them."""
    depth: Floats
    """Depth of the highest one so far in each strip along gravity, (T, STRIPS) [m]."""
    down: tuple[float, float]
    """Direction of gravity, a unit vector."""

    @classmethod
    def of(
        cls, masks: Mask, others: Mask, pixels: Pixels, gravity: Sequence[float]
    ) -> "Hit":
        """Contacts with walls and other things.

        Parameters
        ----------
        masks, others
            Where it is, and where other things are, (T, N, N).
        pixels
            Where pixels are.
        gravity
            [m/s^2].
        """
        walls = rim(pixels.side, WALL + 0.006)
        size = max(math.hypot(*gravity), 1e-6)
        down = gravity[0] / size, gravity[1] / size
        first = int(np.argmax(masks.any(axis=(1, 2))))
        frame = len(masks)
        depth = np.full((len(masks), STRIPS), np.inf)
        for number in range(first + 1, len(masks)):
            depth[number] = depth[number - 1]
            touched = masks[number] & (walls | around(others[number], 1))
            if not touched.any():
                continue
            rows, columns = np.nonzero(touched)
            deep, strip = _along(pixels.places(rows, columns), down)
            if frame == len(masks):  # what is hit first spoils all at its height
                frame = number - 1
                depth[number] = deep.min()
            for k in range(-BESIDE, BESIDE + 1):
                beside = np.clip(strip + k, 0, STRIPS - 1)
                np.minimum.at(depth[number], beside, deep)
        return cls(frame, depth, down)

    def beneath(self, pixels: Pixels, number: int) -> Mask:
        """Pixels (N, N) of a frame that may show what rebounds."""
        deep, strip = _pixels_along(pixels, self.down)
        found: Mask = deep > self.depth[number, strip] - REBOUND
        return found


@lru_cache(maxsize=4)
def _pixels_along(
    pixels: Pixels, down: tuple[float, float]
) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Depth and strip of every pixel, (N, N) each."""
    deep, strip = _along(np.stack(np.meshgrid(*pixels.centers()), axis=-1), down)
    deep.flags.writeable = strip.flags.writeable = False
    return deep, strip


def _along(
    places: Floats, down: tuple[float, float]
) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Depth of places (..., 2) along a direction, and the strips that they lie in."""
    aside = places @ np.array([-down[1], down[0]])
    strip = np.floor((aside + 1.5) / 3.0 * STRIPS).astype(np.int64)
    return places @ np.array(down), strip


class Flow:
    """Frames of a thing that comes out of a nozzle, compared with free flight.

    Parameters
    ----------
    masks, hidden
        Where it is and where other things are, (T, N, N).
    frames
        Numbers of the frames that count.
    pixels
        Where pixels are.
    frame_time
        Simulated time between frames [s].
    hit
        Contacts; frames after them tell what lies well above them.
    """

    def __init__(
        self,
        masks: Mask,
        hidden: Mask,
        frames: Sequence[int],
        pixels: Pixels,
        frame_time: float,
        hit: Hit | None = None,
    ) -> None:
        self._pixels, self._times = pixels, [frame_time * k for k in frames]
        everywhere: Mask = np.any(masks[list(frames)], axis=0)
        self._window = pixels.window(everywhere, MARGIN)
        radius = BALL * SPACING * pixels.side
        reach = math.ceil(radius)
        offsets = np.mgrid[-reach : reach + 1, -reach : reach + 1]
        r2 = (offsets**2).sum(axis=0) / radius**2
        self._ball = (np.maximum(1.0 - r2, 0.0) ** 2).astype(np.float32)
        self._telling = [
            self._clear(hidden[k], hit.beneath(pixels, k) if hit else None)
            for k in frames
        ]
        rows, columns = self._window
        seen = [
            _halved(masks[k][rows, columns]) * telling
            for k, telling in zip(frames, self._telling, strict=True)
        ]
        self._blurred = [_on_scales(s) for s in seen]
        self._total = float(sum(s.sum() for s in seen)) + 12.0

    def _clear(self, hidden: Mask, spoiled: Mask | None) -> Any:
        near = around(hidden, CLEAR) | rim(self._pixels.side, WALL + 0.01)
        if spoiled is not None:
            near |= spoiled
        rows, columns = self._window
        return _halved(~near[rows, columns])

    def misfit(self, nozzle: Mapping[str, Any], gravity: Sequence[float]) -> float:
        """Squared difference on several scales, over the area that is seen.

        Parameters
        ----------
        nozzle
            ``center``, ``width``, and ``emission``, plain data.
        gravity
            [m/s^2].
        """
        emission = nozzle["emission"]
        width, speed = nozzle["width"], math.hypot(*emission["velocity"])
        dense = emission["rate"] * SPACING**2 / (width * speed)
        if dense > DENSEST:
            return float(20.0 + 10.0 * dense)
        total = 0.0
        g = np.asarray(gravity)
        times, places, velocities = self._births(emission, width)
        pairs = zip(self._times, self._telling, self._blurred, strict=True)
        for time, telling, seen in pairs:
            born = times <= time
            age = (time - times[born])[:, None]
            x = places[born] + nozzle["center"] + velocities[born] * age
            drawn = _on_scales(self._drawn(x + 0.5 * g * age**2) * telling)
            for (_, _, weight), a, b in zip(SCALES, drawn, seen, strict=True):
                total += weight * float(np.square(a - b).sum())
        unusual = 0.0 if emission["type"] == "rain" else math.log(dense / USUAL)
        return float(total / self._total + UNUSUAL * unusual**2)

    def _births(self, emission: Data, width: float) -> tuple[Floats, Floats, Floats]:
        numbers = emission | {"stop": self._times[-1] + 0.02}
        if emission["type"] != "hose":
            model = EMISSIONS[emission["type"]].model_construct(**numbers)
            return model.births(width, SPACING)
        model = EMISSIONS["jet"].model_construct(**(numbers | {"type": "jet"}))
        times, *vectors = model.births(width, SPACING)
        phase = 2 * np.pi * (times - emission["start"]) / emission["period"]
        turn = math.radians(emission["swing_deg"]) * np.sin(phase)
        turned = [(v @ [1, 1j]) * np.exp(1j * turn) for v in vectors]
        places, velocities = (np.stack([z.real, z.imag], axis=1) for z in turned)
        return times, places, velocities

    def _drawn(self, x: Floats) -> Any:
        side, middle = self._pixels.side, self._pixels.middle
        rows, columns = self._window
        shape = (
            min(rows.stop, side) - rows.start,
            min(columns.stop, side) - columns.start,
        )
        j = np.rint((1.0 - x[:, 1]) * side - middle).astype(int) - rows.start
        i = np.rint(x[:, 0] * side - middle).astype(int) - columns.start
        inside = (j >= 0) & (i >= 0) & (j < shape[0]) & (i < shape[1])
        number = j[inside] * shape[1] + i[inside]
        counts = np.bincount(number, minlength=shape[0] * shape[1])
        image = counts.reshape(shape).astype(np.float32)
        balls = cv2.filter2D(image, -1, self._ball, borderType=cv2.BORDER_CONSTANT)
        return _halved((balls > COVERS) | (image > 0))


def _halved(mask: Any) -> Any:
    h, w = mask.shape
    size = max(w // 2, 1), max(h // 2, 1)
    return cv2.resize(mask.astype(np.float32), size, interpolation=cv2.INTER_AREA)


def _on_scales(image: Any) -> list[Any]:
    """The image, reduced and blurred in several ways."""
    found = []
    for reduction, blur, _ in SCALES:
        size = tuple(max(n // reduction, 1) for n in image.shape[::-1])
        small = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
        found.append(cv2.GaussianBlur(small, (0, 0), blur))
    return found
