"""Shapes as vectors of numbers: where a fit of each kind starts, and what it is."""

import math
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import cv2
import numpy as np
import numpy.typing as npt

from mpmworlds.baselines.search.perception.pixels import Data, Mask, Pixels

Floats = npt.NDArray[np.float64]

BLADES: Final = (2, 3, 4, 5, 6)
GAPS: Final = (0.0, 60.0, 120.0, 180.0, 240.0)  # of rings that a fit starts with [deg]
HOLLOW: Final = 0.9  # part of its convex hull that a solid shape fills
TINY: Final = 0.004  # least length of a shape [m]


@dataclass(frozen=True)
class Start:
    """Where a fit of a kind of shape starts."""

    kind: str
    """Type of the shape."""
    numbers: tuple[float, ...]
    """What `build` makes it from."""
    steps: tuple[float, ...]
    """How far off each of them may be."""
    build: Callable[[Sequence[float]], Data]
    """The shape of such numbers."""


@dataclass(frozen=True)
class _Measures:
    """What a mask says at once."""

    center: Floats
    area: float
    box_center: Floats
    width: float
    height: float
    degrees: float
    wall: float
    solid: bool
    angles: Floats
    radii: Floats


def starts(mask: Mask, pixels: Pixels, kinds: Collection[str] = ()) -> list[Start]:
    """Starts of all kinds but polygons that a mask may be one of.

    If some kinds are asked for, starts of those, however unlike them the mask is:
    something in front may cut it.
    """
    seen = _measured(mask, pixels)
    step = 1.0 / pixels.side
    sure = bool(kinds)
    found: list[Start] = []
    if seen.solid or sure:
        found += _solid(seen, step, sure=sure)
    if not seen.solid or sure:
        found += _rings(mask, pixels, seen, step)
        found += _fans(seen, step, sure=sure)
    return [start for start in found if not kinds or start.kind in kinds]


def _measured(mask: Mask, pixels: Pixels) -> _Measures:
    rows, columns = np.nonzero(mask)
    points = np.stack([columns, rows], axis=1).astype(np.float32)
    (cx, cy), (w, h), degrees = cv2.minAreaRect(points)
    w, h = (w + 1) / pixels.side, (h + 1) / pixels.side
    turned = -degrees
    if w < h:
        w, h, turned = h, w, turned + 90.0
    hull = cv2.contourArea(cv2.convexHull(points))
    solid = len(rows) / max(hull + 0.5 * cv2.arcLength(cv2.convexHull(points), True), 1)
    center = pixels.centroid(mask)
    arm = pixels.places(rows, columns) - center
    padded = np.pad(mask.astype(np.uint8), 1)
    wall = cv2.distanceTransform(padded, cv2.DIST_L2, 5).max() / pixels.side
    return _Measures(
        center=center,
        area=pixels.area(mask),
        box_center=pixels.places(cy, cx),
        width=w,
        height=h,
        degrees=float((turned + 90.0) % 180.0 - 90.0),
        wall=2.0 * float(wall),
        solid=bool(solid > HOLLOW) and not _has_hole(mask),
        angles=np.arctan2(arm[:, 1], arm[:, 0]),
        radii=np.hypot(arm[:, 0], arm[:, 1]),
    )


def _has_hole(mask: Mask) -> bool:
    outside = np.pad(mask, 1)
    count, _, stats, _ = cv2.connectedComponentsWithStats((~outside).astype(np.uint8))
    sizes = sorted(stats[k, cv2.CC_STAT_AREA] for k in range(1, count))
    return len(sizes) > 1 and sizes[-2] >= 9


def _solid(seen: _Measures, step: float, *, sure: bool) -> Iterator[Start]:
    c, m, s = tuple(seen.center), tuple(seen.box_center), step
    w, h, turn = seen.width, seen.height, seen.degrees
    radius = math.sqrt(seen.area / math.pi)
    yield Start("circle", (*c, radius), (s, s, s), _circle)
    yield Start("box", (*m, turn, w, h), (s, s, 2.0, s, s), _box)
    yield Start("ellipse", (*c, turn, w / 2, h / 2), (s, s, 2.0, s, s), _ellipse)
    corner = 0.2 * h
    yield Start(
        "rounded_box", (*m, turn, w, h, corner), (s, s, 2.0, s, s, 2 * s), _rounded
    )
    if w > 1.25 * h or sure:
        start = (*m, turn, max(w - h, TINY), h / 2)
        yield Start("capsule", start, (s, s, 2.0, 2 * s, s), _capsule)


def _rings(mask: Mask, pixels: Pixels, seen: _Measures, step: float) -> Iterator[Start]:
    center, radius = _circle_through(mask, pixels)
    heading = seen.center - center
    away = math.degrees(math.atan2(-heading[1], -heading[0])) - 90.0
    for gap in GAPS:
        part = math.radians(360.0 - gap)
        wall = min(max(seen.area / max(radius * part, TINY), TINY), 1.9 * radius)
        numbers = (*center, away, radius, wall, gap)
        widths = (2 * step, 2 * step, 8.0, 2 * step, step, 15.0 if gap else 0.0)
        yield Start("ring", numbers, widths, _ring if gap else _closed_ring)


def _circle_through(mask: Mask, pixels: Pixels) -> tuple[Floats, float]:
    """Center and radius of the circle nearest to pixels [Kasa 1976]."""
    p = pixels.places(*np.nonzero(mask))
    a = np.column_stack([2.0 * p, np.ones(len(p))])
    z = np.linalg.lstsq(a, (p**2).sum(axis=1), rcond=None)[0]
    return z[:2], math.sqrt(max(float(z[2] + z[:2] @ z[:2]), 1e-6))


def _fans(seen: _Measures, step: float, *, sure: bool) -> Iterator[Start]:
    reach = float(np.quantile(seen.radii, 0.995))
    outer = seen.radii > 0.5 * reach
    for count in BLADES:
        wave = np.exp(1j * count * seen.angles[outer]).mean()
        if abs(wave) < 0.25 and count > 2 and not sure:
            continue
        first = math.degrees(float(np.angle(wave))) / count
        numbers = (*seen.center, first, reach - seen.wall / 2, 0.8 * seen.wall)
        yield Start(
            "fan_blades", numbers, (step, step, 4.0, 2 * step, step), _fan(count)
        )


def polygons(mask: Mask, pixels: Pixels, most: int) -> Iterator[Start]:
    """Starts of polygons of ever more corners, up to `most`."""
    padded = np.pad(mask.astype(np.uint8), 1)
    fine = cv2.resize(padded, None, fx=4, fy=4, interpolation=cv2.INTER_NEAREST)
    fine = (cv2.GaussianBlur(fine * 255, (0, 0), 2.0) > 127).astype(np.uint8)
    contours, _ = cv2.findContours(fine, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    outlines = [max(contours, key=cv2.contourArea)]
    if len(contours) > 1:  # something in front of it cuts it into pieces
        outlines.append(cv2.convexHull(np.concatenate(contours)))
    counts = set()
    for tolerance in (10.0, 7.0, 5.0, 3.5, 2.5):
        for number, outline in enumerate(outlines):
            corners = cv2.approxPolyDP(outline, tolerance, True)[:, 0].astype(float)
            if (number, len(corners)) in counts or not 3 <= len(corners) <= most:
                continue
            counts.add((number, len(corners)))
            at = (corners + 0.5) / 4.0 - 1.0  # in pixels, from the edge of the image
            x = (at[:, 0] - 0.5 + pixels.middle) / pixels.side
            y = 1.0 - (at[:, 1] - 0.5 + pixels.middle) / pixels.side
            # Hulls go the other way around than contours do.
            numbers = np.stack([x, y], axis=1)[:: -1 if number == 0 else 1].ravel()
            step = 1.0 / pixels.side
            yield Start("polygon", tuple(numbers), (step,) * len(numbers), polygon)


def polygon(v: Sequence[float]) -> Data:
    """The polygon of corners x0, y0, x1, ...; its center is that of its area."""
    p = np.asarray(v, np.float64).reshape(-1, 2)
    q = np.roll(p, -1, axis=0)
    twice = p[:, 0] * q[:, 1] - q[:, 0] * p[:, 1]
    if abs(twice.sum()) < 1e-6:
        raise ValueError("corners enclose no area")
    center = twice @ (p + q) / (3.0 * twice.sum())
    return {
        "type": "polygon",
        "center": center.tolist(),
        "angle_deg": 0.0,
        "vertices": (p - center).tolist(),
    }


def _placed(kind: str, v: Sequence[float], **more: Any) -> Data:
    return {"type": kind, "center": [float(v[0]), float(v[1])]} | more


def _turned(kind: str, v: Sequence[float], **more: Any) -> Data:
    return _placed(kind, v, angle_deg=math.remainder(float(v[2]), 360.0), **more)


def _long(value: float, most: float = 1.0) -> float:
    return min(max(float(value), TINY), most)


def _circle(v: Sequence[float]) -> Data:
    return _placed("circle", v, radius=_long(v[2], 0.5))


def _box(v: Sequence[float]) -> Data:
    return _turned("box", v, size=[_long(v[3]), _long(v[4])])


def _ellipse(v: Sequence[float]) -> Data:
    a, b = _long(v[3], 0.5), _long(v[4], 0.5)
    a = max(a, b / 4.9)
    return _turned("ellipse", v, semi_axes=[a, max(b, a / 4.9)])


def _rounded(v: Sequence[float]) -> Data:
    size = [_long(v[3]), _long(v[4])]
    corner = min(max(float(v[5]), 0.001), 0.499 * min(size))
    return _turned("rounded_box", v, size=size, corner_radius=corner)


def _capsule(v: Sequence[float]) -> Data:
    return _turned("capsule", v, length=_long(v[3]), radius=_long(v[4], 0.25))


def _closed_ring(v: Sequence[float]) -> Data:
    radius = _long(v[3], 0.5)
    wall = min(_long(v[4], 0.5), 1.9 * radius)
    return _turned("ring", [*v[:2], 0.0], radius=radius, thickness=wall)


def _ring(v: Sequence[float]) -> Data:
    closed = _closed_ring(v)
    gap = min(max(float(v[5]), 20.0), 320.0)
    return closed | _turned("ring", v, opening_deg=gap)


def _fan(count: int) -> Callable[[Sequence[float]], Data]:
    def build(v: Sequence[float]) -> Data:
        return _turned(
            "fan_blades",
            v,
            blade_count=count,
            blade_length=_long(v[3], 0.5),
            thickness=_long(v[4], 0.2),
        )

    return build
