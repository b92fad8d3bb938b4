"""All metrics by name, and the scores of one prediction.

What stands in `mpmworlds.metrics.definitions` is a metric; there is no other list.
"""

import pkgutil
from collections.abc import Iterator, Mapping
from importlib import import_module
from types import MappingProxyType
from typing import Final

from mpmworlds.metrics import definitions
from mpmworlds.metrics.clips import Clip
from mpmworlds.metrics.metric import Metric
from mpmworlds.metrics.view import View, compared


def _defined() -> Iterator[Metric]:
    for module in pkgutil.iter_modules(definitions.__path__):
        for item in vars(
            import_module(f"{definitions.__name__}.{module.name}")
        ).values():
            if isinstance(item, Metric):
                yield item


SCORED: Final[Mapping[str, Metric]] = MappingProxyType(
    {m.name: m for m in sorted(_defined(), key=lambda m: m.column)}
)
"""Everything that `score` reports, in the order of a table."""

METRICS: Final[Mapping[str, Metric]] = MappingProxyType(
    {name: m for name, m in SCORED.items() if m.paper_name}
)
"""The paper's seven metrics, in the order of its tables."""


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


def score(pred: Clip | View, ref: Clip | View) -> dict[str, float]:
    """Compute all metrics of one prediction.

    Parameters
    ----------
    pred, ref : uint8 array, shape (T, H, W, 3), or View
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
    one, other = compared(pred, ref)
    return {name: metric(one, other) for name, metric in SCORED.items()}
