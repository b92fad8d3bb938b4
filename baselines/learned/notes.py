"""The note in a folder of a checkpoint that says what it is, and of which version."""

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

from mpmworlds.files.atomic import write_atomically

NOTE: Final = "mpmworlds.json"


class CheckpointError(ValueError):
    """A folder is no checkpoint of what is asked for."""


@dataclass(frozen=True)
class Note:
    """What a checkpoint is."""

    family: str
    """Name of the kind of model, e.g. ``small``."""
    version: int
    """Of the form of its files; another one cannot be loaded."""
    settings: dict[str, Any] = field(default_factory=dict)
    """With what it was trained."""
    made_of: dict[str, Any] = field(default_factory=dict)
    """Release, configuration, split and regime that it was trained on."""
    steps: int = 0
    """Steps of the optimiser so far."""


def write_note(folder: Path, note: Note) -> None:
    """Write the note of a checkpoint; after all else of it."""
    text = json.dumps(asdict(note), indent=2, sort_keys=True) + "\n"
    write_atomically(folder / NOTE, text.encode())


def read_note(folder: Path, family: str, version: int) -> Note:
    """Read the note of a checkpoint.

    Raises
    ------
    CheckpointError
        If there is none, or it is of another family or version.
    """
    path = folder / NOTE
    if not path.is_file():
        raise CheckpointError(
            f"{folder}: is no checkpoint, it has no {NOTE}; name what `mpmworlds train "
            f"{family} --out` has written"
        )
    try:
        note = Note(**json.loads(path.read_text("utf-8")))
    except (ValueError, TypeError) as error:
        raise CheckpointError(f"{path}: is no note of a checkpoint ({error})") from None
    if note.family != family:
        raise CheckpointError(f"{folder}: is a model {note.family}, must be {family}")
    if note.version != version:
        raise CheckpointError(
            f"{folder}: is of version {note.version}, must be {version}; train it "
            "again, or use the version of mpmworlds that wrote it"
        )
    return note
