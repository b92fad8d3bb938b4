"""Weights: where they lie, and what tells them apart."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from mpmworlds.baselines.learned.notes import NOTE, CheckpointError, Note, read_note
from mpmworlds.baselines.vdm.text import TEXT_VERSION
from mpmworlds.files.checksums import sha256_of_file

FAMILY: Final = "vdm"
VERSION: Final = 1  # of the form of a checkpoint
BASE: Final = ("checkpoint", "revision", "checkpoint_sha256")  # of `told_apart`
INDEX: Final = "model_index.json"
SUFFIX: Final = ".safetensors"


def is_folder(checkpoint: str) -> bool:
    """Whether a name is that of a folder that is here, not of a repository."""
    return Path(checkpoint).is_dir()


def check_checkpoint(checkpoint: str, file: str = INDEX) -> None:
    """Raise unless a name is a folder with a file, or may be a repository's.

    Raises
    ------
    FileNotFoundError
        If it is neither.
    """
    folder = Path(checkpoint)
    if folder.is_dir():
        if not (folder / file).is_file():
            raise FileNotFoundError(
                f"{checkpoint}: has no {file}; name the folder of a pipeline as "
                "`save_pretrained` writes it, or a repository on the Hub"
            )
    elif folder.is_absolute() or checkpoint.count("/") != 1 or checkpoint[0] in ".~":
        raise FileNotFoundError(
            f"checkpoint {checkpoint!r}: is no folder, and no OWNER/NAME of the Hub"
        )


def digest_of(path: Path) -> str:
    """SHA-256 of a file, or of the names and contents of the files of a folder."""
    if path.is_file():
        return sha256_of_file(path)
    whole = hashlib.sha256()
    for file in sorted(p for p in path.rglob("*") if p.is_file()):
        name = file.relative_to(path).as_posix()
        whole.update(f"{sha256_of_file(file)}  {name}\n".encode())
    return whole.hexdigest()


def told_apart(checkpoint: str, revision: str, lora: str) -> dict[str, Any]:
    """What tells weights apart: a digest of a folder, or name and revision on the Hub.

    Returns
    -------
    dict
        `checkpoint` and `revision`, or `checkpoint_sha256`; and `lora_sha256` if there
        is a LoRA. Places of folders are empty, for a folder may be moved.
    """
    told: dict[str, Any]
    if is_folder(checkpoint):
        told = {"checkpoint": "", "checkpoint_sha256": digest_of(Path(checkpoint))}
    else:
        told = {"checkpoint": checkpoint, "revision": commit_of(checkpoint, revision)}
    if lora:
        told |= {"lora": "", "lora_sha256": digest_of(lora_file(lora))}
    return told


def commit_of(repository: str, revision: str) -> str:
    """The commit that a repository on the Hub is at.

    Raises
    ------
    FileNotFoundError
        If there is none, it is no pipeline, or the Hub cannot be reached.
    """
    from huggingface_hub import hf_hub_download
    from huggingface_hub.errors import HfHubHTTPError, LocalEntryNotFoundError

    try:
        index = hf_hub_download(repository, INDEX, revision=revision or None)
    except LocalEntryNotFoundError:
        raise FileNotFoundError(
            f"{repository}: is not here, and the Hub cannot be reached; `hf download "
            f"{repository}` where it can, or name a folder"
        ) from None
    except HfHubHTTPError as error:  # no such repository, revision or file
        raise FileNotFoundError(
            f"{repository}: is no pipeline that the Hub has ({type(error).__name__}); "
            f"compare name and revision, it must have a {INDEX}"
        ) from None
    return Path(index).parent.name


def lora_file(lora: str) -> Path:
    """The file of LoRA weights that a file or a folder is.

    Raises
    ------
    FileNotFoundError
        If there is none.
    """
    path = Path(lora)
    if path.is_file():
        return path
    found = sorted(path.glob(f"*{SUFFIX}"))
    if len(found) != 1:
        raise FileNotFoundError(
            f"lora {lora}: has {len(found)} files *{SUFFIX}, must have one; name what "
            "`mpmworlds train vdm --out` has written"
        )
    return found[0]


def trained_with(lora: str) -> Mapping[str, Any]:
    """Settings, regime and revision that a LoRA of ours was trained with, else none.

    Raises
    ------
    CheckpointError
        If it was trained on other texts than a model is told now, or is none.
    """
    note = _note_of(lora)
    if note is None:
        return {}
    text = note.made_of.get("text")
    if text != TEXT_VERSION:
        raise CheckpointError(
            f"{lora}: was trained on texts {text}, they are {TEXT_VERSION} now; train "
            "it again, or use the version of mpmworlds that wrote it"
        )
    of_note = ("revision", "regime")
    return note.settings | {k: note.made_of[k] for k in of_note if k in note.made_of}


def check_base(lora: str, weights: Mapping[str, Any]) -> None:
    """Raise unless a LoRA that was trained here is used on what it was trained on.

    Parameters
    ----------
    lora
        Folder or file.
    weights
        Of `told_apart`, of the pipeline that it is put on.

    Raises
    ------
    CheckpointError
        If it was trained on another pipeline.
    """
    note = _note_of(lora)
    if note is None:
        return
    for name in BASE:
        trained, used = note.made_of.get(name), weights.get(name)
        if trained != used:
            raise CheckpointError(
                f"{lora}: was trained on {name} {trained}, must not be used on {used}; "
                "leave out the checkpoint and its revision, or name those"
            )


def _note_of(lora: str) -> Note | None:
    folder = Path(lora)
    if not lora or not (folder / NOTE).is_file():
        return None
    return read_note(folder, FAMILY, VERSION)
