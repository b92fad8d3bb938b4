"""The files of one sample: preview, poster, exact video, and what is told of it."""

import hashlib
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from mpmworlds.files.atomic import write_atomically
from mpmworlds.loaders.clips import CLIP, VIDEO, clip_of
from mpmworlds.loaders.gallery.site import script
from mpmworlds.sim.run.preview import PREVIEW_CODEC, encode_preview, poster

FORM: Final = 1
"""Of the files; a change of what they hold is a new number."""
TOLD: Final = (
    "id",
    "seeds",
    "edit",
    "scene",
    "program",
    "ceiling",
    "num_frames",
    "framerate",
    "resolution",
    "scene_sha256",
    "program_sha256",
    "frames_sha256",
)
_NAME: Final = re.compile(r"\w[\w.-]*", re.ASCII)


def names_of(sample: str, *, exact: bool) -> set[str]:
    """Names of the files of a sample, relative to the gallery.

    Raises
    ------
    ValueError
        If its id is no name for a file.
    """
    if not _NAME.fullmatch(sample):
        raise ValueError(
            f"sample {sample!r}: must be named by letters, digits, '_', '-' and '.'"
        )
    names = {f"previews/{sample}.{suffix}" for suffix in ("mp4", "png")}
    return names | {f"samples/{sample}.js", *([f"videos/{sample}.mp4"] * exact)}


def key_of(row: Mapping[str, Any], parent: str | None, *, exact: bool) -> str:
    """What the files of a sample depend on, in hexadecimal.

    Parameters
    ----------
    row
        Its columns; videos need not be among them.
    parent
        Scene that it was made from, if that is known.
    exact
        Whether its exact video is shown.
    """
    told = {name: row[name] for name in row if name not in (CLIP, VIDEO)}
    made_of = [FORM, PREVIEW_CODEC, exact, parent, told]
    return hashlib.sha256(json.dumps(made_of, sort_keys=True).encode()).hexdigest()


def write_files(
    root: Path,
    row: Mapping[str, Any],
    parent: str | None,
    *,
    exact: bool,
    shown: Mapping[str, Any] | None = None,
) -> None:
    """Write the files of a sample.

    Parameters
    ----------
    root
        Folder of the gallery.
    row
        Its columns, `clip` or `video` among them.
    parent
        Scene that it was made from, if that is known.
    exact
        Whether to write its exact video, where it has one.
    shown
        Row of the same sample with `preview` and `poster`; they are made if left out,
        which takes most of the time.

    Raises
    ------
    ValueError
        If they are to be made, and it has no video that can be decoded.
    """
    sample = row["id"]
    preview, picture = _previewed(row, shown)
    told: dict[str, Any] = {name: row[name] for name in TOLD if name in row}
    video = (row.get(VIDEO) or {}).get("bytes") if exact else None
    told |= {"exact": len(video) if video else 0, "parent": parent}
    write_atomically(root / f"previews/{sample}.png", picture)
    write_atomically(root / f"previews/{sample}.mp4", preview)
    if video:
        write_atomically(root / f"videos/{sample}.mp4", video)
    write_atomically(root / f"samples/{sample}.js", script("onSample", told))


def _previewed(
    row: Mapping[str, Any], shown: Mapping[str, Any] | None
) -> tuple[bytes, bytes]:
    """Preview and poster of a row."""
    if shown is not None:
        return shown["preview"]["bytes"], shown["poster"]["bytes"]
    clip = clip_of(row)
    return encode_preview(clip.frames, clip.framerate), poster(clip.frames)
