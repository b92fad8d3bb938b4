"""Collapse: the largest share of a body's visible area that a clip loses."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from mpmworlds.metrics.clips import Clip, Curve
from mpmworlds.metrics.constants import CONSTANTS
from mpmworlds.metrics.metric import Metric
from mpmworlds.metrics.regions import colour_features, has_colour, region_means
from mpmworlds.metrics.view import View, compared, viewed


def _losses(view: View) -> Curve:
    """Compute s(t), the largest loss of area among the regions: `(T,)`."""
    means = region_means(view.clip[0], view.constants)
    if len(means) == 0:
        return np.ones(view.shape[0])
    features = colour_features(view.colours)
    areas = view.areas(
        np.stack([has_colour(features, mean, view.constants) for mean in means])
    )
    first = areas[:, :1]
    lost = np.where(first > 0, 1 - areas / np.maximum(first, 1), 1.0)
    return np.asarray(np.maximum(lost, 0.0).max(axis=0))


def curve(pred: Clip | View) -> Curve:
    """Compute the largest loss of area among the regions in every frame.

    Parameters
    ----------
    pred : uint8 array, shape (T, H, W, 3)
        Prediction, RGB.

    Returns
    -------
    float64 array, shape (T,)
        `s(t) = max_n max(0, 1 - a_n(t) / a_n(0))`, in [0, 1]; s(0) is 0 but for regions
        that cannot be followed. All 1 when the early frame has no region.

    Raises
    ------
    ValueError
        If the array is no clip, or a side is below 4 pixels.
    """
    return viewed(pred, "prediction").once(_losses)


def collapse(pred: Clip | View) -> float:
    """Compute the largest share of area that any early region loses (OCS).

    Down is better. Judges the prediction alone. Regions are those of the first frame:
    it is filtered by a 3 x 3 median; its foreground is divided by colour (the fullest
    of 16 x 16 x 16 RGB bins and all pixels near its mean, and so on with what is left);
    of each part the 8-connected pieces of at least 25 pixels count, unless a 3 x 3
    erosion leaves less than 9 pixels of them; parts whose means differ by less than
    0.05 (L2) in chromaticity and 0.15 in brightness, also by way of others, are one.
    The area a_n(t) counts the foreground pixels of frame t, unfiltered, within 0.05
    (L2) and 0.25 of the region's mean.

    Parameters
    ----------
    pred : uint8 array, shape (T, H, W, 3)
        Prediction, RGB.

    Returns
    -------
    float
        In [0, 1]: max over n and t > 0 of `max(0, 1 - a_n(t) / a_n(0))`, where a region
        with a_n(0) = 0 counts as lost; 1 when the first frame has no region; else 0 for
        a single frame, which loses nothing.

    Raises
    ------
    ValueError
        If the array is no clip, or a side is below 4 pixels.
    """
    return float(curve(pred).max())


def excess_curve(pred: Clip | View, ref: Clip | View) -> Curve:
    """Compute how much more of a body the prediction has lost by every frame.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes.

    Returns
    -------
    float64 array, shape (T,)
        Largest s up to t, less that of the reference, at least 0; the last value is
        `collapse_excess`.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape, or a side is below 4 pixels.
    """
    one, other = compared(pred, ref)
    so_far = (np.maximum.accumulate(curve(view)) for view in (one, other))
    return np.maximum(np.subtract(*so_far), 0.0)


def collapse_excess(pred: Clip | View, ref: Clip | View) -> float:
    """Compute how much more of a body the prediction loses than the truth does.

    Down is better. Things do leave the picture and get covered: the truth collapses,
    too.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes.

    Returns
    -------
    float
        In [0, 1]: `max(0, collapse(pred) - collapse(ref))`.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape, or a side is below 4 pixels.
    """
    return float(excess_curve(pred, ref)[-1])


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


def _bound(begun: View, _ref: View) -> float:
    """What is lost is lost."""
    return collapse(begun)


COLLAPSE: Final = Metric(
    collapse,
    curve,
    direction="down",
    worst=1.0,
    best=0.0,
    column=1,
    paper_name="OCS",
    needs_reference=False,
    bound=_bound,
)
COLLAPSE_EXCESS: Final = Metric(
    collapse_excess,
    excess_curve,
    direction="down",
    worst=1.0,
    best=0.0,
    column=8,
    anchored=True,
    selected_by="collapse",
)
