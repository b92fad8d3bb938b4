"""Full supervised finetuning of Qwen2.5-VL: all weights, on programs or scenes."""

import json
from pathlib import Path
from typing import Any, Final

from mpmworlds.baselines.learned.extras import need
from mpmworlds.baselines.learned.notes import NOTE, Note, read_note
from mpmworlds.baselines.learned.settings import Settings
from mpmworlds.baselines.vlm.places import FAMILY, VERSION, Place, located
from mpmworlds.baselines.vlm.settings import CHECKPOINTS, TrainingSettings
from mpmworlds.files.targets import check_folder
from mpmworlds.loaders.export.folder import Source
from mpmworlds.loaders.prompts import PROMPT_VERSION
from mpmworlds.loaders.scaffold import SCAFFOLD_VERSION

ELSEWHERE: Final = ("workers",)  # settings that may change when a training goes on


def train(
    source: Source, settings: Settings, out_dir: Path, *, progress: bool = True
) -> Path:
    """Finetune a model, or go on with it.

    To be called by each process of `accelerate launch`, or alone. The folder gets the
    model as ``save_pretrained`` writes it, its note, ``log.json`` with the losses, and
    ``checkpoints/``, which may be removed when all is done.

    Parameters
    ----------
    source
        The samples, and what is told of them.
    settings
        A `TrainingSettings`.
    out_dir
        Folder of the training; one that was stopped goes on from its last checkpoint.
    progress
        Show a progress bar on standard error.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    ValueError
        If a setting is impossible here, or the folder holds another training.
    CheckpointError, TooLittleMemoryError
        If there is no such model, or it does not fit.
    """
    need("vlm", "torch", "transformers", "accelerate", "PIL")
    if not isinstance(settings, TrainingSettings):
        raise TypeError(f"settings are {type(settings).__name__}, not those of vlm")
    check_folder(out_dir)
    place = located(settings.checkpoint, settings.revision)
    note = Note(FAMILY, VERSION, _noted(settings), _made_of(source, place))
    done = out_dir / NOTE
    for folder in (out_dir, out_dir / CHECKPOINTS):
        if (folder / NOTE).is_file():
            _check_same(folder, note)
    if done.is_file():
        return out_dir
    from mpmworlds.baselines.vlm.learning.run import Run

    Run(source.load(), settings, place, out_dir, note).carry_out(progress=progress)
    return out_dir


def _noted(settings: TrainingSettings) -> dict[str, Any]:
    """Settings that the result depends on."""
    data: dict[str, Any] = json.loads(settings.model_dump_json())
    kept = {key: value for key, value in data.items() if key not in ELSEWHERE}
    return kept | {"checkpoint": ""} if Path(settings.checkpoint).is_dir() else kept


def _made_of(source: Source, place: Place) -> dict[str, Any]:
    words = {"prompt": PROMPT_VERSION, "scaffold": SCAFFOLD_VERSION}
    return source.noted() | dict(place.identity) | words


def _check_same(folder: Path, note: Note) -> None:
    """Refuse to go on with another training."""
    known = read_note(folder, FAMILY, VERSION)
    now, then = (one.settings | one.made_of for one in (note, known))
    differs = [key for key in now if now[key] != then.get(key)]
    if differs:
        told = ", ".join(f"{k} = {then.get(k)!r}, not {now[k]!r}" for k in differs)
        raise ValueError(
            f"{folder}: holds a training with {told}; name another folder by --out, or "
            "remove that one"
        )
