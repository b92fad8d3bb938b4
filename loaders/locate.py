"""Where the release is that the bare name ``mpmworlds`` stands for."""

import os
from pathlib import Path
from typing import Final

from mpmworlds.files.checksums import CHECKSUMS

NAME: Final = "mpmworlds"
VARIABLE: Final = "MPMWORLDS_RELEASE"
HUB_REPOSITORY: Final = "mpmworlds/mpmworlds"
USUAL_PLACES: Final = (Path(NAME), Path("release") / NAME)


class ReleaseNotFoundError(FileNotFoundError):
    """``$MPMWORLDS_RELEASE`` names a folder that holds no release."""


def is_release(folder: Path) -> bool:
    """Tell whether a folder is a release: a card, checksums, and data of ours."""
    parts = (
        folder / "README.md",
        folder / CHECKSUMS,
        folder / "data",
        folder / "splits",
    )
    return all(part.exists() for part in parts)


def resolve() -> str:
    """Return the folder or the Hub repository that ``mpmworlds`` stands for.

    First ``$MPMWORLDS_RELEASE``, then a release in ``./mpmworlds`` or
    ``./release/mpmworlds``, then the repository on the Hub.

    Raises
    ------
    ReleaseNotFoundError
        If the variable is set to something else than a release.
    """
    named = os.environ.get(VARIABLE)
    if named:
        if not is_release(Path(named)):
            raise ReleaseNotFoundError(
                f"${VARIABLE} = {named!r}: holds no release (README.md, {CHECKSUMS}, "
                "data, splits); build one there, or correct or unset the variable"
            )
        return str(Path(named).absolute())
    for place in USUAL_PLACES:
        if is_release(place):
            return str(place.absolute())
    return HUB_REPOSITORY
