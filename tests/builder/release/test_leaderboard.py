"""eval.yaml, as the Hub reads it."""

import yaml

from mpmworlds.builder.release.leaderboard import REGIMES, leaderboard_text
from mpmworlds.loaders import regimes
from mpmworlds.metrics import SCORED

SPLITS = {
    "tiny": ["train", "test"],
    "evaluation": ["test", "modification_validation"],
}


def test_every_evaluation_split_and_regime_is_one_task():
    told = yaml.safe_load(leaderboard_text(SPLITS))
    assert set(told) == {"name", "description", "evaluation_framework", "tasks"}
    tasks = {task["id"]: (task["config"], task["split"]) for task in told["tasks"]}
    assert len(tasks) == len(told["tasks"]) == 2 * len(regimes.REGIMES)
    assert tasks == {
        f"{split}-{regime}": ("evaluation", split)
        for split in SPLITS["evaluation"]
        for regime in regimes.REGIMES
    }


def test_the_number_that_ranks_is_one_that_a_summary_has():
    description = yaml.safe_load(leaderboard_text(SPLITS))["description"]
    assert "continuation.mask_iou.failures_at_worst.mean" in description
    assert SCORED["mask_iou"].best == 1.0


def test_a_release_without_the_fixed_samples_is_no_benchmark():
    assert leaderboard_text({"tiny": ["test"]}) is None


def test_regimes_are_those_that_there_are():
    assert set(REGIMES) == set(regimes.REGIMES)
