"""The verb about a release: verify."""

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
