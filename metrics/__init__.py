"""Metrics of predicted physics videos, version `VERSION`.

A clip is ``uint8 (T, H, W, 3)``, RGB, on a black background; compared clips have equal
shapes. Each metric is a pure function of arrays; the per-frame or per-time values
behind it are ``METRICS[name].curve``.
"""

from mpmworlds.metrics.aggregate import (
    Interval,
    Row,
    Summary,
    normalised_scores,
    summarise,
)
from mpmworlds.metrics.anomaly import anomaly, anomaly_excess
from mpmworlds.metrics.collapse import collapse, collapsed_share
from mpmworlds.metrics.color_tv import color_tv
from mpmworlds.metrics.constants import CONSTANTS, VERSION, Constants, definition
from mpmworlds.metrics.mask_iou import mask_iou
from mpmworlds.metrics.mse import mse
from mpmworlds.metrics.registry import METRICS, SCORED, Metric, metric_named, score
from mpmworlds.metrics.select import best_of_n
from mpmworlds.metrics.semd import semd
from mpmworlds.metrics.wmae import wmae

__all__ = [
    "CONSTANTS",
    "METRICS",
    "SCORED",
    "VERSION",
    "Constants",
    "Interval",
    "Metric",
    "Row",
    "Summary",
    "anomaly",
    "anomaly_excess",
    "best_of_n",
    "collapse",
    "collapsed_share",
    "color_tv",
    "definition",
    "mask_iou",
    "metric_named",
    "mse",
    "normalised_scores",
    "score",
    "semd",
    "summarise",
    "wmae",
]
