"""The numbers that say at a glance what a change did: `dvc metrics diff` shows them."""

import json
from collections.abc import Mapping
from typing import Any

from mpmworlds.metrics import METRICS


def headline(summary: Mapping[str, Any]) -> dict[str, float]:
    """Return the paper's seven metrics of a summary, and the share of failures.

    Parameters
    ----------
    summary
        Content of a ``summary.json``.

    Returns
    -------
    dict of str to float
        Means over all samples, failures at the worst value, to six digits: more would
        differ between machines and say nothing.

    Raises
    ------
    ValueError
        If nothing was evaluated.
    """
    if not summary["candidates"]:
        raise ValueError("summary of no candidates: has no numbers; evaluate some")
    means = {
        name: summary["continuation"][name]["failures_at_worst"]["mean"]
        for name in METRICS
    }
    means["failed"] = 1 - summary["outcomes"].get("ok", 0) / summary["candidates"]
    return {name: float(f"{value:.6g}") for name, value in means.items()}


def headline_text(summary: Mapping[str, Any]) -> str:
    """Return the numbers as JSON, a line each."""
    return json.dumps(headline(summary), indent=1) + "\n"
