"""The numbers that a pipeline shows of a change."""

import json

import pytest

from mpmworlds.baselines.headline import headline, headline_text
from mpmworlds.metrics import METRICS


def summary_of(outcomes, value=1 / 3):
    means = {"failures_at_worst": {"mean": value}, "valid": {"mean": 1.0}}
    return {
        "candidates": sum(outcomes.values()),
        "outcomes": outcomes,
        "continuation": dict.fromkeys(METRICS, means),
    }


def test_there_are_the_seven_metrics_and_the_share_of_failures():
    told = headline(summary_of({"ok": 3, "timed_out": 1}))
    assert told == {**dict.fromkeys(METRICS, 0.333333), "failed": 0.25}
    assert len(told) == 8


def test_last_bits_do_not_show():
    outcomes = {"ok": 2}
    near = headline_text(summary_of(outcomes, 1 / 3 + 1e-12))
    assert near == headline_text(summary_of(outcomes))
    assert json.loads(near) == headline(summary_of(outcomes))


def test_nothing_evaluated_is_refused():
    with pytest.raises(ValueError, match="has no numbers; evaluate some"):
        headline(summary_of({}))
