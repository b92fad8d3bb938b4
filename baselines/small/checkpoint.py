"""A trained network in a folder: weights as safetensors, and a note of what it is."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from safetensors.torch import load_file, save

from mpmworlds.baselines.learned.notes import (
    CheckpointError,
    Note,
    read_note,
    write_note,
)
from mpmworlds.baselines.small.network import LabelUNet, Shape
from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.checksums import sha256_of_file

FAMILY: Final = "small"
VERSION: Final = 1
WEIGHTS: Final = "model.safetensors"


def save_network(
    network: LabelUNet, weights: Mapping[str, Any], folder: Path, note: Note
) -> None:
    """Write weights of a network, float32 or less, and its note.

    Parameters
    ----------
    network
        For its shape.
    weights
        Tensors by the names of the network's parameters.
    folder
        Is made if it is not there.
    note
        Its settings get the shape of the network.
    """
    folder.mkdir(parents=True, exist_ok=True)
    data = save({k: v.detach().cpu().contiguous() for k, v in weights.items()})
    write_atomically(folder / WEIGHTS, data)
    settings = {**note.settings, "shape": asdict(network.shape)}
    write_note(
        folder, Note(note.family, note.version, settings, note.made_of, note.steps)
    )


def load_network(folder: Path, device: Any) -> tuple[LabelUNet, Note]:
    """Load a network, to predict.

    Raises
    ------
    CheckpointError
        If the folder holds none, or one of another version.
    """
    note = read_note(folder, FAMILY, VERSION)
    try:
        shape = dict(note.settings["shape"])
        network = LabelUNet(Shape(**shape | {"channels": tuple(shape["channels"])}))
        network.load_state_dict(load_file(folder / WEIGHTS))
    except (OSError, LookupError, TypeError, RuntimeError) as error:
        raise CheckpointError(f"{folder}: cannot be loaded: {error}") from None
    return network.to(device).float().eval(), note


def weights_sha256(folder: Path) -> str:
    """Digest of the weights.

    Raises
    ------
    CheckpointError
        If there are none.
    """
    try:
        return sha256_of_file(folder / WEIGHTS)
    except OSError as error:
        raise CheckpointError(f"{folder}: has no weights ({error})") from None
