"""The verbs about a release: verify, regenerate."""

import argparse
import json
from pathlib import Path
from typing import Any

from mpmworlds.cli.common import (
    DOES_NOT_HOLD,
    DONE,
    WHOSE,
    add_workers,
    new_verb,
    say,
    say_where,
)
from mpmworlds.files.targets import check_folder, refuse_file

REGENERATED = Path("work/regenerated")


def add_verify(verbs: Any) -> None:
    """Add the verb `verify`."""
    parser = new_verb(
        verbs,
        verify,
        "verify a release: files, rows, every video, sampled re-simulation",
        "mpmworlds verify release/mpmworlds --resimulate 2",
    )
    parser.add_argument("release", type=Path, help="folder of the release")
    parser.add_argument(
        "--resimulate",
        type=int,
        default=1,
        metavar="N",
        help="rows to simulate again and compare, drawn by chance (default 1)",
    )
    parser.add_argument(
        "--seed", help="draw the same rows again: the seed that an earlier run has said"
    )
    parser.add_argument(
        "--no-videos",
        action="store_true",
        help="do not decode videos, and simulate nothing: hold their bytes to the "
        "checksums alone",
    )
    add_workers(parser)
    parser.add_argument("--json", action="store_true", help="print findings as JSON")


def verify(options: argparse.Namespace) -> int:
    """Look for anything wrong in a release."""
    from mpmworlds.builder.release.verify import verify_release

    refuse_file(options.release)
    if not options.release.is_dir():
        raise ValueError(
            f"{options.release}: there is no such folder; build a release there with "
            f"`mpmworlds build --out {options.release}`"
        )
    found = verify_release(
        options.release,
        options.resimulate,
        options.workers,
        seed=options.seed,
        videos=not options.no_videos,
    )
    if options.json:
        answer = {
            "release": str(options.release),
            "findings": [finding.as_dict() for finding in found.findings],
            "seed": found.seed,
            "simulated": [simulated._asdict() for simulated in found.simulated],
            "recorded": list(found.recorded),
            "videos": found.videos,
        }
        print(json.dumps(answer))
    else:
        for simulated in found.simulated:
            say(f"{simulated.id}: simulated again: {simulated.text}")
        if found.simulated:
            say(f"rows were drawn by chance; --seed {found.seed} draws them again")
        if not found.videos:
            say("videos were not decoded")
        lines = [f"{options.release}/{finding}" for finding in found.findings]
        print("\n".join(lines) or f"{options.release}: intact")
    return DOES_NOT_HOLD if found.findings else DONE


def add_regenerate(verbs: Any) -> None:
    """Add the verb `regenerate`."""
    parser = new_verb(
        verbs,
        regenerate,
        "make one sample anew, from its scene to its video, and compare it",
        "mpmworlds regenerate p0123-c4 --release release/mpmworlds --verify",
    )
    parser.description += f" {WHOSE}"
    parser.add_argument("id", help="id of the sample")
    parser.add_argument(
        "--release",
        type=Path,
        help="folder of a release that has it (default: its scene is that of the "
        "recorded manifest; with --verify: where `load_dataset` finds mpmworlds)",
    )
    parser.add_argument(
        "--config",
        help="configuration of the release (default: the first that has it, those with "
        "videos and of the corpus full before others), or, without a release, of "
        "params.yaml (default full)",
    )
    parser.add_argument(
        "--out", type=Path, help=f"folder to write into (default {REGENERATED}/ID)"
    )
    parser.add_argument(
        "--verify",
        action="store_true",
        help="compare program and frames with the release; status 1 if they are "
        "neither equal, bit for bit, nor within metric tolerance",
    )
    parser.add_argument("--json", action="store_true", help="print the outcome as JSON")


def regenerate(options: argparse.Namespace) -> int:
    """Make a sample anew."""
    from mpmworlds.builder.release.regenerate import regenerate as regenerated
    from mpmworlds.splits.ids import SampleId

    SampleId.parse(options.id)  # before it names a folder
    out = options.out or REGENERATED / options.id
    check_folder(out)
    if options.verify and options.release is None:
        options.release = _usual_release()
    made = regenerated(
        options.id, options.release, options.config, to_compare=options.verify
    )
    say_where(made.id, made.source, () if options.config else made.namesakes)
    paths = made.write(out)
    tier = made.compared() if options.verify else None
    if options.json:
        answer = {"id": made.id, "source": made.source, "files": list(map(str, paths))}
        print(json.dumps(answer | (tier._asdict() if tier else {})))
    else:
        print("\n".join(map(str, paths)))
        if tier:
            print(f"{made.id}: {tier.text}")
    return DOES_NOT_HOLD if tier and tier.name == "neither" else DONE


def _usual_release() -> Path:
    """Folder of the release that `load_dataset` finds."""
    from mpmworlds.loaders.locate import HUB_REPOSITORY, resolve

    found = resolve()
    if found == HUB_REPOSITORY:
        raise ValueError(
            "there is no release here to compare with; name one with --release, or "
            "build one: mpmworlds build --out release/mpmworlds"
        )
    return Path(found)
