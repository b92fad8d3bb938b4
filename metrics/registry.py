"""All metrics by name, and the scores of one prediction."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Literal

from mpmworlds.metrics.anomaly import anomaly, anomaly_excess, flag
from mpmworlds.metrics.anomaly import curve as anomaly_curve
from mpmworlds.metrics.clips import Clip, Curve
from mpmworlds.metrics.collapse import collapse
from mpmworlds.metrics.collapse import curve as collapse_curve
from mpmworlds.metrics.color_tv import color_tv
from mpmworlds.metrics.color_tv import curve as color_tv_curve
from mpmworlds.metrics.mask_iou import curve as mask_iou_curve
from mpmworlds.metrics.mask_iou import mask_iou
from mpmworlds.metrics.mse import curve as mse_curve
from mpmworlds.metrics.mse import mse
from mpmworlds.metrics.semd import curve as semd_curve
from mpmworlds.metrics.semd import semd
from mpmworlds.metrics.wmae import curve as wmae_curve
from mpmworlds.metrics.wmae import wmae


@dataclass(frozen=True)
class Metric:
    """One metric: what it is called, which way is good, and how to compute it."""

    name: str
    """Name in code and in result files."""
    paper_name: str
    """Name in the paper's tables; empty if the paper does not report it."""
    direction: Literal["up", "down"]
    """Which way is better."""
    worst: float
    """Value that a failed candidate scores."""
    function: Callable[..., float]
    """The metric: of (pred, ref), or of (pred) where `needs_reference` is false."""
    curve: Callable[..., Curve]
    """Its values per frame or per time, with the same arguments."""
    needs_reference: bool = True
    """Whether the reference is an argument."""

    def __call__(self, pred: Clip, ref: Clip) -> float:
        """Compute the metric, leaving out the reference if it takes none."""
        return self.function(pred, ref) if self.needs_reference else self.function(pred)

    def is_better(self, a: float, b: float) -> bool:
        """Return whether value a is strictly better than value b."""
        return a > b if self.direction == "up" else a < b


_MASK_IOU = Metric("mask_iou", "mIoU", "up", 0.0, mask_iou, mask_iou_curve)
_COLLAPSE = Metric("collapse", "OCS", "down", 1.0, collapse, collapse_curve, False)
_WMAE = Metric("wmae", "W-MAE", "down", 1.0, wmae, wmae_curve)
_COLOR_TV = Metric("color_tv", "CTV", "down", 1.0, color_tv, color_tv_curve)
_ANOMALY = Metric("anomaly", "RTSJ", "down", 1.0, anomaly, anomaly_curve)
_SEMD = Metric("semd", "SEMD", "down", 1.0, semd, semd_curve)
_MSE = Metric("mse", "MSE", "down", 1.0, mse, mse_curve)
_EXCESS = Metric("anomaly_excess", "", "down", 1.0, anomaly_excess, anomaly_curve)

METRICS: Final[Mapping[str, Metric]] = MappingProxyType(
    {m.name: m for m in (_MASK_IOU, _COLLAPSE, _WMAE, _COLOR_TV, _ANOMALY, _SEMD, _MSE)}
)
"""The paper's seven metrics, in the order of its tables."""

SCORED: Final[Mapping[str, Metric]] = MappingProxyType(
    {**METRICS, _EXCESS.name: _EXCESS}
)
"""Everything that `score` reports: the seven and `anomaly_excess`."""


def metric_named(name: str) -> Metric:
    """Look up a metric that `score` reports.

    Parameters
    ----------
    name : str
        A key of `SCORED`.

    Returns
    -------
    Metric
        The metric of that name.

    Raises
    ------
    ValueError
        If there is none (the message lists them).
    """
    if name not in SCORED:
        raise ValueError(f"metric {name!r}: unknown, must be one of {list(SCORED)}")
    return SCORED[name]


def score(pred: Clip, ref: Clip) -> dict[str, float]:
    """Compute all metrics of one prediction.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3)
        Prediction and reference, RGB, equal shapes, H and W at least 4.

    Returns
    -------
    dict of str to float
        One finite value per key of `SCORED`, in that order.

    Raises
    ------
    ValueError
        If the arrays are not two clips of equal shape, or a side is below 4 pixels.
    """
    # One pass over the HSV histograms serves both the flag and the excess.
    excess = anomaly_excess(pred, ref)
    known = {"anomaly": flag(excess), "anomaly_excess": excess}
    return {
        name: known[name] if name in known else metric(pred, ref)
        for name, metric in SCORED.items()
    }
