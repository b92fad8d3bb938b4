"""Where a checkpoint is, and what tells it from others."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mpmworlds.baselines.learned.notes import NOTE, CheckpointError, read_note
from mpmworlds.files.checksums import sha256_of_file

FAMILY: Final = "vlm"
VERSION: Final = 1  # of the files that a training writes
QWEN: Final = "Qwen/Qwen2.5-VL-7B-Instruct"
WEIGHTS: Final = "*.safetensors"
READ: Final = (WEIGHTS, "*.json", "*.jinja", "*.txt")  # of a checkpoint


@dataclass(frozen=True)
class Place:
    """A checkpoint on this machine."""

    folder: Path
    identity: Mapping[str, str]
    """Its name and revision on the Hub, or the digest of its files."""


def located(checkpoint: str, revision: str = "") -> Place:
    """Find a checkpoint, on this machine or on the Hub.

    Parameters
    ----------
    checkpoint
        Folder, or name of a repository of the Hub, which is downloaded if need be.
    revision
        Of the repository; its newest one if empty.

    Raises
    ------
    CheckpointError
        If there is none; says what can be done.
    """
    folder = Path(checkpoint)
    if folder.is_dir():
        if revision:
            raise CheckpointError(
                f"{checkpoint}: is a folder, revision = {revision!r} cannot be one of "
                "its; leave it out"
            )
        return Place(folder, {"weights_sha256": _digest(folder)})
    if checkpoint.startswith((".", "/")) or checkpoint.count("/") != 1:
        raise CheckpointError(
            f"{checkpoint}: is no folder, and no name on the Hub such as {QWEN}"
        )
    folder = _downloaded(checkpoint, revision)
    _check(folder)
    return Place(folder, {"revision": folder.name})


def check_trained(folder: Path, wanted: str) -> None:
    """Raise if a checkpoint was finetuned here to write something else."""
    if not (folder / NOTE).is_file():
        return
    trained = read_note(folder, FAMILY, VERSION).settings.get("task", wanted)
    if trained != wanted:
        raise CheckpointError(
            f"{folder}: was trained to write a {trained}, not a {wanted}; set "
            f"task = {trained}"
        )


def _downloaded(name: str, revision: str) -> Path:
    from huggingface_hub import snapshot_download

    try:
        found = snapshot_download(
            name, revision=revision or None, allow_patterns=list(READ)
        )
    except (OSError, ValueError) as error:  # whatever the Hub says is one of these
        said = str(error).strip().splitlines()[0]
        raise CheckpointError(
            f"{name}: cannot be had from the Hub ({type(error).__name__}: {said}); "
            "without network, download it elsewhere and name its folder"
        ) from error
    return Path(found)


def _check(folder: Path) -> None:
    if not any(folder.glob(WEIGHTS)):
        raise CheckpointError(
            f"{folder}: has no {WEIGHTS}, so it is no checkpoint; name a folder that "
            "save_pretrained or `mpmworlds train vlm` has written"
        )


def _digest(folder: Path) -> str:
    """Of all that decides what a checkpoint writes."""
    _check(folder)
    paths = {path for pattern in READ for path in folder.glob(pattern)}
    lines = [
        f"{path.name} {sha256_of_file(path)}\n"
        for path in sorted(paths)
        if path.name != NOTE
    ]
    return hashlib.sha256("".join(lines).encode()).hexdigest()
