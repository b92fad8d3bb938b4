"""The verb that brings a release into the forms of training scripts: export."""

import argparse
from pathlib import Path
from typing import Any

from mpmworlds.cli.common import (
    DONE,
    add_regime,
    add_samples,
    add_workers,
    new_verb,
)

_SFT, _VIDEO = "sft", "video"
_OF_SFT = ("task", "pictures", "schema")  # options of one form only
_OF_VIDEO = ("metadata",)


def add_export(verbs: Any) -> None:
    """Add the verb `export`."""
    parser = new_verb(
        verbs,
        export,
        "export a split for training: chats with pictures, or clips with texts",
        "mpmworlds export sft --config 10k --split train --regime no_materials "
        "--out exports/sft",
    )
    parser.add_argument(
        "form",
        choices=[_SFT, _VIDEO],
        help="sft: chats (JSON lines and PNG files) whose answer is the program; "
        "video: lossless clips with texts, as videofolder and diffusers take them",
    )
    add_samples(parser, "train")
    add_regime(parser)
    parser.add_argument("--out", type=Path, required=True, help="folder to write")
    parser.add_argument("--limit", type=int, help="export only so many samples")
    add_workers(parser)
    parser.add_argument(
        "--task", choices=["program", "scene"], help="sft: the answer (default program)"
    )
    parser.add_argument(
        "--pictures", type=int, help="sft: frames of the prefix to show (default 8)"
    )
    parser.add_argument(
        "--schema",
        action="store_true",
        default=None,
        help="sft: tell the JSON Schema with the task scene",
    )
    parser.add_argument(
        "--metadata", choices=["jsonl", "csv"], help="video: the list (default jsonl)"
    )


def export(options: argparse.Namespace) -> int:
    """Export a split of a release."""
    from mpmworlds.loaders.export.folder import Source
    from mpmworlds.loaders.export.sft import export_sft
    from mpmworlds.loaders.export.video import export_video

    own, others = (_OF_SFT, _OF_VIDEO) if options.form == _SFT else (_OF_VIDEO, _OF_SFT)
    if wrong := [name for name in others if getattr(options, name) is not None]:
        raise ValueError(f"--{wrong[0]}: is no option of {options.form}; leave it out")
    given = {name: getattr(options, name) for name in own}
    settings: Any = {name: v for name, v in given.items() if v is not None}
    source = Source(options.release, options.config, options.split, options.regime)
    write = export_sft if options.form == _SFT else export_video
    count = write(
        source,
        options.out,
        limit=options.limit,
        workers=options.workers,
        **settings,
    )
    print(f"{options.out}: {count} samples of {options.config}/{options.split}")
    return DONE
