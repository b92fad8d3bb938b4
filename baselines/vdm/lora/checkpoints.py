"""Checkpoints of a training: LoRA weights, the optimiser, and a note of both.

The random state is the number of the step, see `windows`.
"""

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import torch
from diffusers import WanVACEPipeline
from peft.utils import get_peft_model_state_dict, set_peft_model_state_dict

from mpmworlds.baselines.learned.notes import (
    NOTE,
    CheckpointError,
    Note,
    read_note,
    write_note,
)
from mpmworlds.baselines.vdm.backends.wan_pipeline import ADAPTER
from mpmworlds.baselines.vdm.weights import FAMILY, VERSION

WEIGHTS: Final = "pytorch_lora_weights.safetensors"  # as diffusers names them
OPTIMISER: Final = "optimiser.pt"
KEPT: Final = 2  # the newest ones
# Settings that change no tensor of a step that is done.
MAY_CHANGE: Final = frozenset(
    {"steps", "save_every", "workers", "device", "text_device"}
)
_WAN: Final[Any] = WanVACEPipeline
PREFIX: Final = "transformer."


def newest(out_dir: Path) -> Path | None:
    """The newest checkpoint that was written whole."""
    found = sorted(path.parent for path in out_dir.glob(f"step-*/{NOTE}"))
    return found[-1] if found else None


def steps_done(
    folder: Path, settings: Mapping[str, Any], made_of: Mapping[str, Any]
) -> int:
    """Steps of a checkpoint of this very training.

    Raises
    ------
    CheckpointError
        If it is of another one; names what differs.
    """
    note = read_note(folder, FAMILY, VERSION)
    told = {**note.settings, **note.made_of}
    asked = {**settings, **made_of}
    differs = sorted(
        key
        for key in (told.keys() | asked.keys()) - MAY_CHANGE
        if told.get(key) != asked.get(key)
    )
    if differs:
        key = differs[0]
        raise CheckpointError(
            f"{folder}: was trained with {key} = {told.get(key)!r}, asked for is "
            f"{asked.get(key)!r}; name another --out, or remove that folder"
        )
    return note.steps


def save(
    out_dir: Path, model: Any, optimiser: torch.optim.Optimizer, note: Note
) -> Path:
    """Write a checkpoint; it has its name when it is whole. Older ones go."""
    folder = out_dir / f"step-{note.steps:07d}"
    part = out_dir / f".{folder.name}.part"
    shutil.rmtree(part, ignore_errors=True)
    _WAN.save_lora_weights(
        part,
        transformer_lora_layers=get_peft_model_state_dict(model, adapter_name=ADAPTER),
    )
    torch.save(optimiser.state_dict(), part / OPTIMISER)
    write_note(part, note)
    part.rename(folder)
    for old in sorted(out_dir.glob("step-*"))[:-KEPT]:
        shutil.rmtree(old)
    return folder


def restore(folder: Path, model: Any, optimiser: Any) -> None:
    """Put a checkpoint into a model that has the adapter, and its optimiser."""
    found = _WAN.lora_state_dict(folder, weight_name=WEIGHTS)
    state = {name.removeprefix(PREFIX): value for name, value in found.items()}
    set_peft_model_state_dict(model, state, adapter_name=ADAPTER)
    optimiser.load_state_dict(torch.load(folder / OPTIMISER, weights_only=True))


def publish(folder: Path, out_dir: Path) -> None:
    """Put weights and note of a checkpoint where predictors look for them."""
    shutil.copyfile(folder / WEIGHTS, out_dir / WEIGHTS)
    write_note(out_dir, read_note(folder, FAMILY, VERSION))
