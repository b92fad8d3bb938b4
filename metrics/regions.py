"""The coloured regions of an early frame, which `collapse` then follows."""

from collections.abc import Iterator

import cv2
import numpy as np
import numpy.typing as npt

from mpmworlds.metrics.clips import (
    Clip,
    Colours,
    Indices,
    Mask,
    packed_colours,
    rgb_bins,
)
from mpmworlds.metrics.constants import Constants

Features = npt.NDArray[np.float64]
"""`(N, 4)`: chromaticity `c / sum(c)` of R, G, B; brightness `max(c) / 255`."""
MEDIAN = 3  # pixels a side: what a codec leaves along outlines goes


def colour_features(colours: Colours) -> Features:
    """Compute chromaticity and brightness of packed colours.

    Parameters
    ----------
    colours : uint32 array, shape (N,)
        `R << 16 | G << 8 | B`, none of them black.

    Returns
    -------
    float64 array, shape (N, 4)
        Chromaticity of R, G and B, and brightness, each in [0, 1].
    """
    rgb = np.stack([colours >> 16, colours >> 8 & 255, colours & 255], axis=1)
    chromaticity = rgb / rgb.sum(axis=1, keepdims=True)
    return np.concatenate([chromaticity, rgb.max(axis=1, keepdims=True) / 255], axis=1)


def has_colour(
    features: Features, mean: Features, constants: Constants
) -> npt.NDArray[np.bool_]:
    """Return which colours count to the area of a region.

    Parameters
    ----------
    features : float64 array, shape (N, 4)
        Colours, as `colour_features` gives them.
    mean : float64 array, shape (4,)
        Mean of the region.
    constants : Constants
        Those of the definition.

    Returns
    -------
    bool array, shape (N,)
        True within 0.05 in chromaticity (L2) and 0.25 in brightness.
    """
    offset = np.abs(features - mean)
    near = np.sqrt((offset[:, :3] ** 2).sum(axis=1))
    return np.asarray(
        (near <= constants.collapse_area_chromaticity)
        & (offset[:, 3] <= constants.collapse_area_brightness)
    )


def _parts(colours: Colours, constants: Constants) -> Iterator[Indices]:
    """Divide pixels by colour, the commonest first: numbers of those of each part.

    A part is the fullest RGB bin of what is left, and every pixel near its mean.
    """
    code = rgb_bins(colours, constants.collapse_bins)
    features, left = colour_features(colours), np.arange(colours.size)
    while left.size >= constants.collapse_min_region_px:
        fullest = np.bincount(code[left]).argmax()
        chosen = code[left] == fullest
        mean = features[left[chosen]].mean(axis=0)
        chosen |= has_colour(features[left], mean, constants)
        yield left[chosen]
        left = left[~chosen]


def _pieces(part: Mask, constants: Constants) -> Mask:
    """The 8-connected pieces of a part that are large enough, if it has a core."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(
        part.astype(np.uint8), connectivity=8
    )
    large = stats[:, cv2.CC_STAT_AREA] >= constants.collapse_min_region_px
    large[0] = False  # which is what does not belong to the part
    kept: Mask = large[labels]
    core = cv2.erode(kept.astype(np.uint8), np.ones((3, 3), np.uint8))
    if np.count_nonzero(core) < constants.collapse_min_core_px:
        return np.zeros_like(part)
    return kept


def _merge_groups(means: Features, constants: Constants) -> Indices:
    """Give similar parts, also those similar by way of others, a common number."""
    offset = means[:, None] - means[None]
    distance = np.sqrt((offset[..., :3] ** 2).sum(axis=2))
    similar = (distance < constants.collapse_merge_chromaticity) & (
        np.abs(offset[..., 3]) < constants.collapse_merge_brightness
    )
    group = np.arange(len(means))
    while True:
        lowest = np.where(similar, group, len(means)).min(axis=1)
        if np.array_equal(lowest, group):
            return group
        group = lowest


def region_means(frame: Clip, constants: Constants) -> Features:
    """Find the regions of an early frame and their mean colours.

    The frame is filtered by a 3 x 3 median per channel; its foreground is divided by
    colour; of each part the connected pieces of at least 25 pixels are kept, if at
    least 9 pixels of them survive a 3 x 3 erosion; similar parts are one region.

    Parameters
    ----------
    frame : uint8 array, shape (H, W, 3)
        The early frame, RGB.
    constants : Constants
        Those of the definition.

    Returns
    -------
    float64 array, shape (R, 4)
        Mean chromaticity and brightness over the pixels of each region. R may be 0.
    """
    smooth: Clip = np.asarray(
        cv2.medianBlur(np.ascontiguousarray(frame), MEDIAN), np.uint8
    )
    mask = smooth.max(axis=2) > constants.foreground_level
    colours = packed_colours(smooth)[mask]
    place = np.flatnonzero(mask)
    parts: list[Features] = []
    for part in _parts(colours, constants):
        whole = np.zeros(mask.size, np.bool_)
        whole[place[part]] = True
        kept = _pieces(whole.reshape(mask.shape), constants)[mask]
        if kept.any():
            parts.append(colour_features(colours[kept]))
    if not parts:
        return np.zeros((0, 4))
    means = np.stack([part.mean(axis=0) for part in parts])
    group = _merge_groups(means, constants)
    regions = [
        np.concatenate([p for p, g in zip(parts, group, strict=True) if g == number])
        for number in np.unique(group)
    ]
    return np.stack([region.mean(axis=0) for region in regions])
