"""The verb that trains a learned baseline: train."""

import argparse
from pathlib import Path
from typing import Any

from mpmworlds.cli.common import (
    DONE,
    add_regime,
    add_samples,
    named_values,
    new_verb,
)

MORE = """\
families, each with the extra that it needs:
  small   a label model that anyone can train in an hour  pip install 'mpmworlds[small]'
  vlm     Qwen2.5-VL, full supervised finetuning           pip install 'mpmworlds[vlm]'
  vdm     a video diffusion model, LoRA                    pip install 'mpmworlds[vdm]'

A recipe is a file of settings that is shipped, or one of your own; --show prints all
settings as they would be, as YAML, and trains nothing. A training that was stopped goes
on from its last checkpoint when the command is given again.

more examples:
  mpmworlds train small --show
  mpmworlds train small --config 10k-clips --set steps=20000 --out work/models/small
  mpmworlds evaluate --predictor small --predictor-option checkpoint=work/models/small
"""


def add_train(verbs: Any) -> None:
    """Add the verb `train`."""
    parser = new_verb(
        verbs,
        train,
        "train a learned baseline on a split of a release, resumably",
        "mpmworlds train small --config mini-clips --out work/models/small",
    )
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog += f"\n\n{MORE}"
    parser.add_argument("family", help="small, vlm or vdm")
    add_samples(parser, "train")
    add_regime(parser)
    parser.add_argument(
        "--recipe", default="", help="name of a shipped recipe, or a file of settings"
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a setting, before that of the recipe; the value as JSON, else as text",
    )
    parser.add_argument("--out", type=Path, help="default: work/models/FAMILY")
    parser.add_argument("--show", action="store_true", help="print the settings only")


def train(options: argparse.Namespace) -> int:
    """Train a model and print where it lies."""
    import yaml

    from mpmworlds.baselines.learned.families import family_named
    from mpmworlds.loaders.export.folder import Source

    family = family_named(options.family)
    changed = named_values(options.set, "--set")
    settings = family.TrainingSettings.read(options.recipe, changed)
    if options.show:
        data = settings.model_dump(mode="json")
        print(yaml.safe_dump(data, sort_keys=False), end="")
        return DONE
    out = options.out or Path("work/models") / options.family
    source = Source(options.release, options.config, options.split, options.regime)
    print(family.train(source, settings, out, progress=True))
    return DONE
