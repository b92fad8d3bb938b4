"""The coloured regions of an early frame, which `collapse` then follows."""

import cv2
import numpy as np
import numpy.typing as npt

from mpmworlds.metrics.clips import Mask
from mpmworlds.metrics.constants import CONSTANTS

Features = npt.NDArray[np.float64]
"""``(N, 4)``: chromaticity ``c / sum(c)`` of R, G, B; brightness ``max(c) / 255``."""
Indices = npt.NDArray[np.intp]


def colour_features(colours: npt.NDArray[np.uint32]) -> Features:
    """Compute chromaticity and brightness of packed colours.

    Parameters
    ----------
    colours : uint32 array, shape (N,)
        ``R << 16 | G << 8 | B``, none of them black.

    Returns
    -------
    float64 array, shape (N, 4)
        Chromaticity of R, G and B, and brightness, each in [0, 1].
    """
    rgb = np.stack([colours >> 16, colours >> 8 & 255, colours & 255], axis=1)
    chromaticity = rgb / rgb.sum(axis=1, keepdims=True)
    return np.concatenate([chromaticity, rgb.max(axis=1, keepdims=True) / 255], axis=1)


def has_colour(features: Features, mean: Features) -> npt.NDArray[np.bool_]:
    """Return which colours count to the area of a region.

    Parameters
    ----------
    features : float64 array, shape (N, 4)
        Colours, as `colour_features` gives them.
    mean : float64 array, shape (4,)
        Mean of the region.

    Returns
    -------
    bool array, shape (N,)
        True within 0.05 in chromaticity (L2) and 0.25 in brightness.
    """
    offset = np.abs(features - mean)
    near = np.sqrt((offset[:, :3] ** 2).sum(axis=1))
    return np.asarray(
        (near <= CONSTANTS.collapse_area_chromaticity)
        & (offset[:, 3] <= CONSTANTS.collapse_area_brightness)
    )


def _components(mask: Mask) -> list[Indices]:
    """List the 8-connected components of >= 25 px as foreground pixel numbers."""
    count, labels = cv2.connectedComponents(mask.astype(np.uint8), connectivity=8)
    label = labels[mask]
    by_label = np.argsort(label, kind="stable")
    sizes = np.bincount(label, minlength=count)[1:]
    members = np.split(by_label, np.cumsum(sizes)[:-1])
    return [m for m in members if m.size >= CONSTANTS.collapse_min_region_px]


def _split_by_colour(
    members: Indices, colours: npt.NDArray[np.uint32]
) -> list[Indices]:
    """Divide a component that holds several colours, most frequent colour first."""
    values, value, counts = np.unique(
        colours[members], return_inverse=True, return_counts=True
    )
    features = colour_features(values)
    left = np.ones(values.size, dtype=bool)
    parts = []
    for commonest in np.argsort(-counts, kind="stable"):
        if left[commonest]:
            near = left & has_colour(features, features[commonest])
            parts.append(members[near[value]])
            left &= ~near
    return [p for p in parts if p.size >= CONSTANTS.collapse_min_region_px]


def _merge_groups(means: Features) -> Indices:
    """Give similar parts, also those similar by way of others, a common number."""
    offset = means[:, None] - means[None]
    distance = np.sqrt((offset[..., :3] ** 2).sum(axis=2))
    similar = (distance < CONSTANTS.collapse_merge_chromaticity) & (
        np.abs(offset[..., 3]) < CONSTANTS.collapse_merge_brightness
    )
    group = np.arange(len(means))
    while True:
        lowest = np.where(similar, group, len(means)).min(axis=1)
        if np.array_equal(lowest, group):
            return group
        group = lowest


def region_means(mask: Mask, packed: npt.NDArray[np.uint32]) -> Features:
    """Find the regions of an early frame and their mean colours.

    A component whose mean is the colour of no pixel of the frame (bodies of different
    colours that touch) is first divided by colour: it could not be followed.

    Parameters
    ----------
    mask : bool array, shape (H, W)
        Foreground of the early frame.
    packed : uint32 array, shape (H, W)
        Its colours, ``R << 16 | G << 8 | B``.

    Returns
    -------
    float64 array, shape (R, 4)
        Mean chromaticity and brightness over the pixels of each region; every mean
        is the colour of at least one pixel. R may be 0.
    """
    colours = packed[mask]
    features = colour_features(colours)
    parts: list[Indices] = []
    for members in _components(mask):
        if has_colour(features, features[members].mean(axis=0)).any():
            parts.append(members)
        else:
            parts.extend(_split_by_colour(members, colours))
    if not parts:
        return np.zeros((0, 4))
    group = _merge_groups(np.stack([features[p].mean(axis=0) for p in parts]))
    regions = [
        np.concatenate([p for p, g in zip(parts, group, strict=True) if g == number])
        for number in np.unique(group)
    ]
    means = np.stack([features[r].mean(axis=0) for r in regions])
    return means[[bool(has_colour(features, mean).any()) for mean in means]]
