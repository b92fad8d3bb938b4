"""Clips and texts for finetuning of models that continue videos."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from mpmworlds.files.atomic import write_atomically
from mpmworlds.loaders.clips import CLIP, clip_of
from mpmworlds.loaders.export.folder import (
    Record,
    Source,
    place_of,
    write_export,
)
from mpmworlds.loaders.load import Examples, neutral_name, side_info_of
from mpmworlds.loaders.prompts import CONTINUE, PROMPT_VERSION
from mpmworlds.loaders.weights import weights_by_kind
from mpmworlds.metrics.reduction import split_clip
from mpmworlds.sim.run.encode import encode_mp4

METADATA: Final = ("jsonl", "csv")


def export_video(
    source: Source,
    out_dir: Path,
    *,
    metadata: str = "jsonl",
    limit: int | None = None,
    workers: int = 1,
) -> int:
    """Write clips with texts in the form of `datasets`' videofolder and of diffusers.

    The folder ``SPLIT`` has lossless MP4 files and ``metadata.jsonl``, with a line for
    each sample: `file_name`, the whole clip; `prefix_file_name` and
    `continuation_file_name`, its two parts; `text`, what the regime tells, or one
    sentence for all where it tells nothing; `weight`, how often it is to be seen;
    `framerate`, `num_frames` and `prefix_frames`; and `sample`, its id.

    Parameters
    ----------
    source
        The samples, and their regime.
    out_dir
        Folder to write, or to go on with.
    metadata
        ``jsonl``, or ``csv`` for the same in a table.
    limit
        Only so many samples, the first ones.
    workers
        Number of processes, 0 for one per core.

    Returns
    -------
    int
        Number of samples.

    Raises
    ------
    ValueError
        If a setting is impossible, or the folder holds another export.
    """
    if metadata not in METADATA:
        raise ValueError(
            f"metadata = {metadata!r}, must be one of {', '.join(METADATA)}"
        )
    settings: Record = {"form": "video", "metadata": metadata, "prompt": PROMPT_VERSION}
    return write_export(
        source,
        settings,
        out_dir,
        f"{source.split}/metadata.{metadata}",
        _write,
        render=table if metadata == "csv" else None,
        limit=limit,
        workers=workers,
    )


def table(records: Sequence[Record]) -> bytes:
    """Records as a CSV file with a line of names."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(records[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(records)
    return text.getvalue().encode()


def _write(examples: Examples, index: int, folder: Path) -> Record:
    row = examples.table[index]
    clip = clip_of(row)
    prefix, continuation = split_clip(*clip)
    place = place_of(neutral_name(row["id"]), ".mp4")
    stored = row.get(CLIP)
    files = {
        "file_name": (
            f"clips/{place}",
            stored["bytes"] if stored else encode_mp4(*clip),
        ),
        "prefix_file_name": (f"prefixes/{place}", encode_mp4(prefix, clip.framerate)),
        "continuation_file_name": (
            f"continuations/{place}",
            encode_mp4(continuation, clip.framerate),
        ),
    }
    for path, data in files.values():
        write_atomically(folder / path, data)
    return {
        **{column: path for column, (path, _) in files.items()},
        "text": side_info_of(row, examples.regime) or CONTINUE,
        "weight": weights_by_kind()[row["kind"]],
        "framerate": clip.framerate,
        "num_frames": len(clip.frames),
        "prefix_frames": len(prefix),
        "sample": row["id"],
    }
