"""Metrics of predicted physics videos, version `VERSION`.

A clip is `uint8 (T, H, W, 3)`, RGB, on a black background; compared clips have equal
shapes. Each metric is a pure function of arrays; the per-frame or per-time values
behind it are `METRICS[name].curve_of`. A clip that is compared with several others is
looked at once if it is handed over as a `View`.
"""

from mpmworlds.metrics.aggregate import (
    Interval,
    Row,
    Summary,
    summarise,
)
from mpmworlds.metrics.constants import CONSTANTS, VERSION, Constants, definition
from mpmworlds.metrics.definitions.anomaly import anomaly, anomaly_excess
from mpmworlds.metrics.definitions.collapse import (
    collapse,
    collapse_excess,
    collapsed_share,
)
from mpmworlds.metrics.definitions.color_tv import color_tv
from mpmworlds.metrics.definitions.mask_iou import mask_iou
from mpmworlds.metrics.definitions.mse import mse
from mpmworlds.metrics.definitions.semd import semd
from mpmworlds.metrics.definitions.wmae import wmae
from mpmworlds.metrics.metric import Metric
from mpmworlds.metrics.ranking import anchored_score, normalised_scores
from mpmworlds.metrics.registry import METRICS, SCORED, metric_named, score
from mpmworlds.metrics.select import best_of_n, oracle_of_n, random_of_n
from mpmworlds.metrics.view import View

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
    "View",
    "anchored_score",
    "anomaly",
    "anomaly_excess",
    "best_of_n",
    "collapse",
    "collapse_excess",
    "collapsed_share",
    "color_tv",
    "definition",
    "mask_iou",
    "metric_named",
    "mse",
    "normalised_scores",
    "oracle_of_n",
    "random_of_n",
    "score",
    "semd",
    "summarise",
    "wmae",
]
