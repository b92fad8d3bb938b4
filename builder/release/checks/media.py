"""The videos of some rows of a release, apart from what else is checked of them.

It is by far what takes longest, so it is done a few rows at a time: processes have
their share of it whatever the sizes of files are.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mpmworlds.builder.release.checks.findings import RENDER, Finding
from mpmworlds.builder.release.checks.videos import preview_faults, video_faults
from mpmworlds.builder.release.features import features_of
from mpmworlds.builder.release.layout import PREVIEW, Batch, Record
from mpmworlds.builder.release.rows import read_rows, rendered_row


@dataclass(frozen=True)
class MediaTask:
    """Rows of a batch whose videos are to be decoded."""

    root: Path
    """Folder of the release."""
    record: Record
    config: str
    path: str
    """Inside the release."""
    batch: Batch
    rows: Sequence[int]
    """Their numbers in the batch."""


def check_media(task: MediaTask) -> list[Finding]:
    """Decode the videos of some rows, and say what is wrong with them."""
    schema = features_of(task.config).arrow_schema
    try:
        rows = read_rows(task.root / task.path, schema, task.batch, task.rows)
    except (OSError, ValueError) as error:
        return [Finding(task.path, f"cannot be read ({error})")]
    findings = []
    for row in rows:
        if task.config == PREVIEW:
            corpus = task.record.configs[task.config].corpus
            other = rendered_row(task.root, task.record, corpus, row["id"])
            faults = preview_faults(row, other)
        else:
            faults = video_faults(row)
        findings += [Finding(task.path, f, RENDER, row["id"]) for f in faults]
    return findings
