"""Verbs about predictions: evaluate, submission."""

import argparse
import json
from pathlib import Path
from typing import Any

from mpmworlds.cli.common import (
    DOES_NOT_HOLD,
    DONE,
    add_ray,
    add_regime,
    add_samples,
    add_workers,
    named_values,
    new_verb,
    say,
)
from mpmworlds.files.atomic import write_atomically

MORE = """\
predictors: black, copy_last, ping_pong, optical_flow, nearest_video, nearest_program,
  search, and, where the regime suits, config_oracle; models, each with its extra:
  small, vdm, vlm, served (behind an OpenAI-compatible server); what knows the answers:
  oracle, noise_ceiling, codec, vae, config_oracle_typical_materials,
  config_oracle_seen_positions;
  or module:Class of your own, with a name and a method predict(task)

more examples:
  a class of your own, made with Mine(checkpoint="a.pt", n=15):
    mpmworlds evaluate --predictor my.module:Mine --predictor-option n=15 \\
      --predictor-option checkpoint=a.pt --regime no_materials
  videos, programs or scenes that were made elsewhere, named by their samples:
    mpmworlds evaluate --predictions folder --config mini --split test
  the samples to evaluate on, of a release with the configuration `evaluation`:
    mpmworlds evaluate --predictor copy_last --config evaluation --split test
  a predictor that looks up training samples:
    mpmworlds evaluate --predictor nearest_video \\
      --predictor-option config=mini --config mini --split test

files in --out:
  results.jsonl   a line per sample and candidate, with where it comes from
  summary.json, summary.txt   means with intervals, and slices
  clips/          with --keep-clips: predicted continuations, for `mpmworlds report`
  scenes/         of what answers with scenes, the best one of each sample: to link, run
                  or play, and for `mpmworlds compare` with the truth
"""


def add_evaluate(verbs: Any) -> None:
    """Add the verb `evaluate`."""
    parser = new_verb(
        verbs,
        evaluate,
        "evaluate a predictor on a split of a release, resumably",
        "mpmworlds evaluate --predictor copy_last --release release/mpmworlds",
    )
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog += f"\n\n{MORE}"
    add_samples(parser, "test")
    who = parser.add_mutually_exclusive_group(required=True)
    who.add_argument("--predictor", help="name of a predictor, or module:Class")
    who.add_argument(
        "--predictions", type=Path, help="folder of predictions made elsewhere"
    )
    parser.add_argument(
        "--predictor-option",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="what the predictor is made with; the value as JSON, else as text",
    )
    add_regime(parser)
    parser.add_argument("--out", type=Path, help="default: work/results/NAME-REGIME")
    parser.add_argument("--limit", type=int, help="evaluate only so many samples")
    parser.add_argument(
        "--list",
        "--ids",
        metavar="NAME",
        help="evaluate only the samples of a list: one of the release, such as "
        "mini_test, or a file with an id a line",
    )
    parser.add_argument(
        "--all-candidates",
        action="store_true",
        help="run all candidates to their end, not only those that the prefix may "
        "choose: tells also what a perfect and what a random choice would be worth",
    )
    parser.add_argument(
        "--keep-clips", action="store_true", help="keep predicted continuations"
    )
    parser.add_argument(
        "--retry-failed",
        type=int,
        default=1,
        metavar="N",
        help="go over samples again, N times, of which nothing can be said because a "
        "server, a network or a machine failed (default 1); giving the command again "
        "does so, too",
    )
    parser.add_argument(
        "--unsafe-no-sandbox",
        action="store_true",
        help="run programs of models with all that you may do",
    )
    add_workers(parser)
    add_ray(parser)
    parser.add_argument(
        "--headline",
        type=Path,
        metavar="FILE",
        help="write the seven metrics and the share of failures there, for "
        "`dvc metrics diff`",
    )
    parser.add_argument("--json", action="store_true", help="print the summary as JSON")


def evaluate(options: argparse.Namespace) -> int:
    """Score a predictor and print the table."""
    from mpmworlds.baselines.evaluate import evaluate as run_evaluation
    from mpmworlds.baselines.headline import headline_text
    from mpmworlds.baselines.predictions import Predictions
    from mpmworlds.baselines.scoring import How
    from mpmworlds.baselines.summary import summary_table

    made_with = named_values(options.predictor_option, "--predictor-option")
    name = options.predictor
    if options.predictions:
        name = f"{Predictions.__module__}:{Predictions.__name__}"
        made_with = {"folder": str(options.predictions), **made_with}
    called = (options.predictions or Path(name.rpartition(":")[2])).name
    out = options.out or Path("work/results") / f"{called}-{options.regime}"
    selection = "all" if options.all_candidates else "prefix"
    path = run_evaluation(
        options.release,
        name,
        options.split,
        out,
        options.config,
        options.limit,
        regime=options.regime,
        options=made_with,
        ids=_ids(options.list, options.release),
        how=How(selection, not options.unsafe_no_sandbox, options.keep_clips),
        retries=options.retry_failed,
        workers=options.workers,
        ray=options.ray,
    )
    summary = json.loads(path.read_text("utf-8"))
    print(json.dumps(summary) if options.json else summary_table(summary))
    if summary["samples"] < summary["expected"]:
        say(f"{out}: incomplete; give the command again to go on")
        return DOES_NOT_HOLD
    if options.headline:
        write_atomically(options.headline, headline_text(summary).encode())
    return DONE


def _ids(named: str | None, release: Path) -> list[str] | None:
    if named is None:
        return None
    of_release = release / "splits" / f"{named}.txt"
    path = of_release if of_release.is_file() else Path(named)
    if not path.is_file():
        there = sorted(found.stem for found in of_release.parent.glob("*.txt"))
        raise ValueError(
            f"--list {named}: is no file and no list of {release}; its lists are "
            f"{', '.join(there)}"
        )
    names = [line.strip() for line in path.read_text("utf-8").splitlines()]
    found = [name for name in names if name and not name.startswith("#")]
    if not found:
        raise ValueError(f"{path}: no ids; write one on each line")
    return found


def add_submission(verbs: Any) -> None:
    """Add the verb `submission`."""
    parser = new_verb(
        verbs,
        submission,
        "pack predictions into a submission, or check one",
        "mpmworlds submission pack predictions --card card.yaml --out mine",
    )
    parser.add_argument("action", choices=["pack", "check"])
    parser.add_argument("folder", type=Path, help="of predictions, or of a submission")
    parser.add_argument("--card", type=Path, help="pack: what made them, as YAML")
    parser.add_argument("--out", type=Path, help="pack: folder to make")
    parser.add_argument("--partial", action="store_true", help="samples may be missing")
    add_samples(parser, "test")


def submission(options: argparse.Namespace) -> int:
    """Make or check a submission."""
    from mpmworlds.baselines.submission import CARD, check, pack
    from mpmworlds.loaders.load import load

    examples = load(options.release, split=options.split, config=options.config)
    expected = set(examples.table["id"])
    if options.action == "check":
        told = check(options.folder, expected, partial=options.partial)
    else:
        if options.out is None:
            raise ValueError("submission pack: needs --out FOLDER")
        card = options.card or options.folder / CARD
        told = pack(
            options.folder, card, options.out, expected, partial=options.partial
        )
    print("\n".join(told))
    return DONE
