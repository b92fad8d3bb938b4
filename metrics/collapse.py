"""Collapse: the largest share of a body's visible area that a clip loses."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from mpmworlds.metrics.clips import (
    Clip,
    Curve,
    check_clip,
    foreground,
    packed_colours,
)
from mpmworlds.metrics.constants import CONSTANTS
from mpmworlds.metrics.regions import colour_features, has_colour, region_means

COLOURS = 1 << 24


def _areas(clip: Clip) -> npt.NDArray[np.int64]:
    """Count the pixels a_n(t) of each early region in each frame: ``(R, T)``.

    Colours are compared once per distinct colour of the clip, not once per pixel.
    """
    mask, packed = foreground(clip), packed_colours(clip)
    means = region_means(mask[0], packed[0])
    seen = np.zeros(COLOURS, dtype=bool)
    seen[packed[mask]] = True
    colours = np.flatnonzero(seen)
    number = np.empty(COLOURS, dtype=np.int32)
    number[colours] = np.arange(colours.size)
    features = colour_features(colours.astype(np.uint32))
    belongs = np.zeros((len(means), colours.size), dtype=bool)
    for row, mean in zip(belongs, means, strict=True):
        row[:] = has_colour(features, mean)
    areas = np.zeros((len(means), clip.shape[0]), dtype=np.int64)
    for t in range(clip.shape[0]):
        areas[:, t] = np.count_nonzero(belongs[:, number[packed[t][mask[t]]]], axis=1)
    return areas


def curve(pred: Clip) -> Curve:
    """Compute the largest loss of area among the regions in every frame.

    Parameters
    ----------
    pred : uint8 array, shape (T, H, W, 3)
        Prediction, RGB.

    Returns
    -------
    float64 array, shape (T,)
        ``s(t) = max_n max(0, 1 - a_n(t) / a_n(0))``, in [0, 1] with s(0) = 0; all 1
        when the early frame has no region.

    Raises
    ------
    ValueError
        If the array is no clip.
    """
    check_clip(pred, "prediction")
    areas = _areas(pred)
    if len(areas) == 0:
        return np.ones(pred.shape[0])
    return np.asarray(np.maximum(1 - areas / areas[:, :1], 0).max(axis=0))


def collapse(pred: Clip) -> float:
    """Compute the largest share of area that any early region loses (OCS).

    Down is better. Judges the prediction alone. Regions are the 8-connected components
    of at least 25 foreground pixels in the first frame, merged when their mean
    chromaticity and brightness differ by less than 0.05 (L2) and 0.15; components
    merge through each other. The area a_n(t) counts the foreground pixels of frame t
    within 0.05 (L2) and 0.25 of the region's mean.

    Parameters
    ----------
    pred : uint8 array, shape (T, H, W, 3)
        Prediction, RGB.

    Returns
    -------
    float
        In [0, 1]: max over n and t > 0 of ``max(0, 1 - a_n(t) / a_n(0))``; 1 when the
        first frame has no region; else 0 for a single frame, which loses nothing.

    Raises
    ------
    ValueError
        If the array is no clip.

    Notes
    -----
    Where bodies of different colours touch, the mean colour of their common component
    may be the colour of no pixel, so that a_n(0) = 0. Such a component is divided by
    colour: the pixels that match its commonest colour are one region, and so on with
    the rest; parts below 25 pixels are dropped.
    """
    return float(curve(pred).max())


def collapsed_share(curves: Sequence[Curve]) -> Curve:
    """Compute the share of samples that have collapsed by each time.

    Parameters
    ----------
    curves : sequence of float64 array, shape (T,)
        `curve` of each sample, equal lengths.

    Returns
    -------
    float64 array, shape (T,)
        Share of samples with s > 0.5 at or before t; never falls.

    Raises
    ------
    ValueError
        If there is no curve, or if their lengths differ.
    """
    lengths = sorted({len(c) for c in curves})
    if len(lengths) != 1:
        raise ValueError(
            f"collapse curves: lengths {lengths}, must be one common length; pass at "
            "least one sample, all of one duration"
        )
    event = np.stack(curves) > CONSTANTS.collapse_event
    return np.asarray(np.logical_or.accumulate(event, axis=1).mean(axis=0))
