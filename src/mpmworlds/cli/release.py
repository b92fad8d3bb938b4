"""Verbs about a release: verify, evaluate."""

import argparse
import json
from pathlib import Path
from typing import Any

from mpmworlds.cli.common import DOES_NOT_HOLD, DONE, add_workers, new_verb


def add_verify(verbs: Any) -> None:
    """Add the verb `verify`."""
    parser = new_verb(
        verbs,
        verify,
        "verify a release: hashes, rows, every video, sampled re-simulation",
        "mpmworlds verify release/mpmworlds --resimulate 2",
    )
    parser.add_argument("release", type=Path, help="folder of the release")
    parser.add_argument(
        "--resimulate", type=int, default=1, help="samples to run again (default 1)"
    )
    add_workers(parser)
    parser.add_argument("--json", action="store_true", help="print findings as JSON")


def verify(options: argparse.Namespace) -> int:
    """Look for anything wrong in a release."""
    from mpmworlds.builder.release.verify import verify_release

    if not options.release.is_dir():
        raise ValueError(
            f"{options.release}: there is no such folder; build a release there with "
            f"`mpmworlds build --out {options.release}`"
        )
    findings = verify_release(options.release, options.resimulate, options.workers)
    if options.json:
        print(json.dumps({"release": str(options.release), "findings": findings}))
    else:
        print("\n".join(findings) or f"{options.release}: intact")
    return DOES_NOT_HOLD if findings else DONE


def add_evaluate(verbs: Any) -> None:
    """Add the verb `evaluate`."""
    parser = new_verb(
        verbs,
        evaluate,
        "evaluate a predictor on a split of a release",
        "mpmworlds evaluate --predictor copy_last --release release/mpmworlds",
    )
    parser.add_argument("--release", type=Path, default=Path("release/mpmworlds"))
    parser.add_argument("--config", default="tiny", help="configuration (default tiny)")
    parser.add_argument("--predictor", required=True, help="name of a predictor")
    parser.add_argument("--split", default="test", help="split (default test)")
    parser.add_argument(
        "--regime",
        default="frames_only",
        help="what it is told of the scenes: frames_only (default), full_config, "
        "no_materials, no_positions or caption",
    )
    parser.add_argument("--out", type=Path, help="default: work/results/PREDICTOR")
    parser.add_argument("--limit", type=int, help="evaluate only so many samples")
    parser.add_argument("--json", action="store_true", help="print the summary as JSON")


def evaluate(options: argparse.Namespace) -> int:
    """Score a predictor and print the table."""
    from mpmworlds.baselines.evaluate import evaluate as run_evaluation
    from mpmworlds.baselines.summary import summary_table

    out = options.out or Path("work/results") / options.predictor
    path = run_evaluation(
        options.release,
        options.predictor,
        options.split,
        out,
        options.config,
        options.limit,
        regime=options.regime,
    )
    summary = json.loads(path.read_text("utf-8"))
    print(json.dumps(summary) if options.json else summary_table(summary))
    return DONE
