"""The seven metrics as one would first write them, from the definitions alone.

NumPy, OpenCV and POT, frame by frame; no thought of speed, and nothing of ours but the
constants.
"""

import cv2
import numpy as np
import numpy.typing as npt
import ot  # type: ignore[import-untyped]

from mpmworlds.metrics import CONSTANTS
from mpmworlds.metrics.clips import Clip

Array = npt.NDArray[np.float64]
TILES = [(i, j) for i in range(4) for j in range(4)]


def foreground(clip: Clip) -> npt.NDArray[np.bool_]:
    """Pixels that are not background."""
    return np.asarray(clip.max(axis=3) > 32)


def tile(image: npt.NDArray[np.generic], i: int, j: int) -> npt.NDArray[np.generic]:
    """One of 4 x 4 tiles of an image."""
    height, width = image.shape[:2]
    rows = slice(i * height // 4, (i + 1) * height // 4)
    return image[rows, j * width // 4 : (j + 1) * width // 4]


def mask_iou(pred: Clip, ref: Clip) -> float:
    """Overlap."""
    p, r = foreground(pred), foreground(ref)
    common, either = (p & r).sum(axis=(1, 2)), (p | r).sum(axis=(1, 2))
    return float(np.where(either > 0, common / np.maximum(either, 1), 1.0).mean())


def features(pixels: npt.NDArray[np.uint8]) -> Array:
    """Chromaticity and brightness of pixels (N, 3)."""
    rgb = pixels.astype(float)
    return np.column_stack(
        [rgb / rgb.sum(axis=1, keepdims=True), rgb.max(axis=1) / 255]
    )


def near(found: Array, mean: Array, chroma: float, brightness: float) -> Array:
    """Which features are near a mean."""
    distance = np.linalg.norm(found[:, :3] - mean[:3], axis=1)
    return (distance <= chroma) & (np.abs(found[:, 3] - mean[3]) <= brightness)


def regions(frame: Clip) -> list[Array]:
    """Means of the regions of an early frame."""
    smooth = cv2.medianBlur(np.ascontiguousarray(frame), 3)
    left, parts = smooth.max(axis=2) > 32, []
    while left.any():
        y, x = np.nonzero(left)
        pixels = smooth[y, x]
        bins, count = np.unique(pixels // 16, axis=0, return_counts=True)
        chosen = (pixels // 16 == bins[count.argmax()]).all(axis=1)
        every = features(pixels)
        chosen |= near(every, every[chosen].mean(axis=0), 0.05, 0.25)
        part = np.zeros(left.shape, np.uint8)
        part[y[chosen], x[chosen]] = 1
        left[y[chosen], x[chosen]] = False
        number, labels, stats, _ = cv2.connectedComponentsWithStats(part)
        kept = np.isin(labels, [k for k in range(1, number) if stats[k, 4] >= 25])
        if cv2.erode(kept.astype(np.uint8), np.ones((3, 3))).sum() >= 9:
            parts.append(features(smooth[kept]))
    merged: list[list[Array]] = []
    for part in parts:
        similar = [
            group
            for group in merged
            if any(
                np.linalg.norm((o.mean(0) - part.mean(0))[:3]) < 0.05
                and abs(o.mean(0)[3] - part.mean(0)[3]) < 0.15
                for o in group
            )
        ]
        merged = [group for group in merged if not any(group is s for s in similar)]
        merged.append([part, *(o for group in similar for o in group)])
    return [np.concatenate(group).mean(axis=0) for group in merged]


def collapse(pred: Clip) -> float:
    """Largest loss of area."""
    means = regions(pred[0])
    areas = np.zeros((len(pred), len(means)))
    for t, frame in enumerate(pred):
        found = features(frame[frame.max(axis=2) > 32])
        areas[t] = [near(found, mean, 0.05, 0.25).sum() for mean in means]
    if not means:
        return 1.0
    lost = np.where(areas[0] > 0, 1 - areas / np.maximum(areas[0], 1), 1.0)
    return float(np.maximum(lost, 0.0).max())


def activity(clip: Clip) -> Array:
    """Smoothed motion of the tiles."""
    luma = clip.astype(np.int64) @ np.array([299, 587, 114])
    change = np.abs(np.diff(luma, axis=0))
    change[change <= 24_000] = 0
    raw = np.array([[tile(frame, *r).mean() for r in TILES] for frame in change])
    windows = [raw[max(t - 4, 0) : t + 4] for t in range(len(raw))]
    return np.array([window.mean(axis=0) for window in windows]) / 255_000


def wmae(pred: Clip, ref: Clip) -> float:
    """Difference of motion."""
    p, r = activity(pred), activity(ref)
    return float(np.abs(p - r).sum() / ((p + r).sum() + 1e-8))


def color_tv(pred: Clip, ref: Clip) -> float:
    """Difference of colours."""
    values = []
    for p, r in zip(pred, ref, strict=True):
        h = [
            np.histogramdd(frame[frame.max(axis=2) > 32], 8, [(0, 256)] * 3)[0]
            for frame in (p, r)
        ]
        sums = [x.sum() for x in h]
        if min(sums) > 0:
            values.append(0.5 * np.abs(h[0] / sums[0] - h[1] / sums[1]).sum())
        else:
            values.append(float(max(sums) > 0))
    return float(np.mean(values))


def tile_histograms(clip: Clip) -> Array:
    """HSV histograms (T, 4, 4, 129), the background last."""
    found = np.zeros((len(clip), 4, 4, 129))
    for t, frame in enumerate(clip):
        h, s, v = cv2.split(cv2.cvtColor(frame, cv2.COLOR_RGB2HSV).astype(np.int64))
        code = h * 8 // 180 * 16 + s * 4 // 256 * 4 + v * 4 // 256
        code[frame.max(axis=2) <= 32] = 128
        for i, j in TILES:
            found[t, i, j] = np.bincount(tile(code, i, j).ravel(), minlength=129)
    return found


def anomaly_excess(pred: Clip, ref: Clip) -> float:
    """Largest jump that the reference does not excuse."""
    p, r = tile_histograms(pred), tile_histograms(ref)
    count, largest = len(pred), 0.0
    for w in (1, 3):
        jumps = []
        for h in (p, r):
            jump = np.zeros((count, 4, 4))
            for t in range(w, count - w + 1):
                before, after = h[t - w : t].mean(axis=0), h[t : t + w].mean(axis=0)
                larger = np.maximum(before[..., :-1].sum(-1), after[..., :-1].sum(-1))
                jump[t] = np.abs(before - after).sum(axis=-1) / 2 / (larger + 64)
            jumps.append(jump)
        for t in range(w, count - w + 1):
            for i, j in TILES:
                around = jumps[1][
                    max(t - 4, 0) : t + 5, max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2
                ]
                largest = max(largest, jumps[0][t, i, j] - around.max())
    colours = []
    for h in (p, r):
        area = h[..., :-1].sum(axis=(1, 2))
        change = np.abs(np.diff(area, axis=0))
        colours.append((change / (np.maximum(area[1:], area[:-1]) + 200)).max(axis=1))
    for t in range(count - 1):
        excused = colours[1][max(t - 4, 0) : t + 5].max()
        largest = max(largest, colours[0][t] - excused)
    return float(largest)


def semd(pred: Clip, ref: Clip) -> float:
    """Sliced distance, by POT."""
    angles = np.pi * np.arange(CONSTANTS.semd_directions) / CONSTANTS.semd_directions
    ways = np.stack([np.cos(angles), np.sin(angles)])
    values = []
    for p, r in zip(pred, ref, strict=True):
        points = [
            np.argwhere(f.max(axis=2) > 32)[:, ::-1] / max(p.shape) for f in (p, r)
        ]
        if min(map(len, points)) > 0:
            values.append(
                ot.sliced_wasserstein_distance(*points, projections=ways, p=1)
            )
        else:
            values.append(float(max(map(len, points)) > 0))
    return float(np.mean(values))


def mse(pred: Clip, ref: Clip) -> float:
    """Difference of pixels."""
    return float(np.mean((pred / 255 - ref / 255) ** 2))


def score(pred: Clip, ref: Clip) -> dict[str, float]:
    """All that `mpmworlds.metrics.score` reports."""
    excess = anomaly_excess(pred, ref)
    lost = collapse(pred)
    return {
        "mask_iou": mask_iou(pred, ref),
        "collapse": lost,
        "wmae": wmae(pred, ref),
        "color_tv": color_tv(pred, ref),
        "anomaly": float(excess > CONSTANTS.anomaly_excess),
        "semd": semd(pred, ref),
        "mse": mse(pred, ref),
        "collapse_excess": max(0.0, lost - collapse(ref)),
        "anomaly_excess": excess,
    }
