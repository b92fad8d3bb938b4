"""The families of models that `mpmworlds train` knows, each in a folder of its own.

A family is a folder of `mpmworlds.baselines` with a module ``training`` that has a
class ``TrainingSettings`` and a function ``train``. It is imported when it is used.
"""

from importlib import import_module
from pathlib import Path
from typing import Final, Protocol

from mpmworlds.baselines.learned.settings import Settings
from mpmworlds.loaders.export.folder import Source

FAMILIES: Final = ("small", "vdm", "vlm")


class Training(Protocol):
    """What a module ``training`` has."""

    TrainingSettings: type[Settings]

    def train(
        self, source: Source, settings: Settings, out_dir: Path, *, progress: bool
    ) -> Path:
        """Train a model, or go on with it.

        Parameters
        ----------
        source
            The samples, and what is told of them.
        settings
            Of the family's own class.
        out_dir
            Folder of the training; one that was stopped goes on from its last
            checkpoint, with the same result.
        progress
            Show a progress bar on standard error.

        Returns
        -------
        Path
            Folder of the checkpoint.
        """
        ...


def family_named(name: str) -> Training:
    """The training of a family.

    Raises
    ------
    ValueError
        If there is none of that name.
    MissingExtraError
        If what it needs is not installed.
    """
    if name not in FAMILIES:
        raise ValueError(f"family {name!r}: unknown, must be one of {list(FAMILIES)}")
    return import_module(f"mpmworlds.baselines.{name}.training")
