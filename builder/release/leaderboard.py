"""`eval.yaml`: what makes a dataset repository of the Hub a benchmark.

The Hub collects the results that model repositories hold in `.eval_results/*.yaml` and
ranks them by task (hub-docs, "Evaluation Results"). A task has one number.
"""

from collections.abc import Collection, Mapping
from typing import Final

import yaml

EVALUATION: Final = "evaluation"  # the configuration of the fixed samples
FRAMEWORK: Final = "mpmworlds"
REGIMES: Final = (  # of `mpmworlds.loaders.regimes`
    "frames_only",
    "full_config",
    "no_materials",
    "no_positions",
    "caption",
)
_DESCRIPTION: Final = (
    "Watch the first 2.5 s of a simulated world of matter and predict the rest, as a "
    "program, a scene or a video. A task is a split of the fixed evaluation samples "
    "under one regime of side information, named SPLIT-REGIME. Its value is the mean "
    "over all samples of the continuation's mask IoU (0 to 1, higher is better), "
    "failures scored as the worst. `mpmworlds evaluate --config evaluation --split "
    "SPLIT --regime REGIME` writes it into summary.json, as "
    "`continuation.mask_iou.failures_at_worst.mean`, beside the other metrics; link "
    "that file as the source of a result."
)


def leaderboard_text(splits: Mapping[str, Collection[str]]) -> str | None:
    """Return `eval.yaml` of a release, or None where nothing can be ranked.

    Parameters
    ----------
    splits
        Configuration -> its splits. Tasks are made of the configuration `evaluation`.

    Returns
    -------
    str or None
        YAML; None if the release lacks the fixed evaluation samples.
    """
    if EVALUATION not in splits:
        return None
    tasks = [
        {"id": f"{split}-{regime}", "config": EVALUATION, "split": split}
        for split in sorted(splits[EVALUATION])
        for regime in REGIMES
    ]
    told = {
        "name": "MPMWorlds",
        "description": _DESCRIPTION,
        "evaluation_framework": FRAMEWORK,
        "tasks": tasks,
    }
    return yaml.safe_dump(told, sort_keys=False, width=88)
