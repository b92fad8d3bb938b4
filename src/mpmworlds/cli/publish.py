"""The verb that puts a release on the Hub: publish."""

import argparse
from pathlib import Path
from typing import Any

from mpmworlds.cli.common import DONE, new_verb, say


def add_publish(verbs: Any) -> None:
    """Add the verb `publish`."""
    parser = new_verb(
        verbs,
        publish,
        "upload a release to the Hugging Face Hub, check it there, and tag it",
        "mpmworlds publish release/mpmworlds --repo-id me/mpmworlds --dry-run",
    )
    parser.add_argument("release", type=Path, help="folder of the release")
    parser.add_argument(
        "--repo-id", required=True, metavar="OWNER/NAME", help="dataset repository"
    )
    parser.add_argument(
        "--revision", metavar="TAG", help="tag (default: the version of the data)"
    )
    parser.add_argument(
        "--private", action="store_true", help="make a new repository a private one"
    )
    parser.add_argument(
        "--dry-run",
        action="store_true",
        help="say what would be sent and removed, and change nothing",
    )


def publish(options: argparse.Namespace) -> int:
    """Publish a release, or say what that would do."""
    from mpmworlds.builder.release import publish as publishing

    upload = publishing.plan_upload(
        options.release,
        options.repo_id,
        revision=options.revision,
        private=options.private,
        report=say,
    )
    print(upload.described(), flush=True)
    if not options.dry_run:
        commit = publishing.publish(upload)
        print(f"{options.repo_id}: tag {upload.tag} is commit {commit}")
    return DONE
