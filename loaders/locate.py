"""Where the release is that the bare name ``mpmworlds`` stands for."""

import os
import time
from pathlib import Path
from typing import Final

from mpmworlds.builder.release.layout import CARD, RECORD
from mpmworlds.files.checksums import CHECKSUMS
from mpmworlds.files.targets import refuse_file

NAME: Final = "mpmworlds"
VARIABLE: Final = "MPMWORLDS_RELEASE"
HUB_REPOSITORY: Final = "mpmworlds/mpmworlds"
TO_CONNECT: Final = 5.0  # seconds until the Hub counts as out of reach
TO_ANSWER: Final = 10.0  # seconds until a Hub that is in reach counts as slow
TO_ASK_AGAIN: Final = 1.0  # seconds; a name may be found the second time
USUAL_PLACES: Final = (Path(NAME), Path("release") / NAME)


class ReleaseNotFoundError(FileNotFoundError):
    """There is no release where one was looked for."""


def is_release(folder: Path) -> bool:
    """Tell whether a folder is a release: a card, a record of ours, checksums, data."""
    parts = (CARD, RECORD, CHECKSUMS, "data")
    return all((folder / part).exists() for part in parts)


def resolve(revision: str | None = None) -> str:
    """Return the folder or the Hub repository that ``mpmworlds`` stands for.

    First ``$MPMWORLDS_RELEASE``, then a release in ``./mpmworlds`` or
    ``./release/mpmworlds``, then the repository on the Hub. A revision is one of the
    Hub's, for a folder has none.

    Raises
    ------
    ReleaseNotFoundError
        If the variable is set to something else than a release.
    """
    if revision:
        return HUB_REPOSITORY
    named = os.environ.get(VARIABLE)
    if named:
        if not is_release(Path(named)):
            raise ReleaseNotFoundError(
                f"${VARIABLE} = {named!r}: holds no release ({CARD}, {RECORD}, "
                f"{CHECKSUMS}, data); build one there, or correct or unset the variable"
            )
        return str(Path(named).absolute())
    for place in USUAL_PLACES:
        if is_release(place):
            return str(place.absolute())
    return HUB_REPOSITORY


def check_place(text: str) -> None:
    """Raise unless this is a release or may be a repository.

    Raises
    ------
    NotADirectoryError
        If it is a file.
    ReleaseNotFoundError
        If it is a folder that holds no release, or neither a folder nor the name of a
        repository.
    """
    refuse_file(text)
    folder = text.startswith((".", "/", "~")) or Path(text).is_dir()
    if folder and not is_release(Path(text)):
        raise ReleaseNotFoundError(
            f"{text}: is no release ({CARD}, {RECORD}, {CHECKSUMS}, data); name the "
            f"folder of one, or build one: mpmworlds build --config tiny --out {text}"
        )
    if not folder and text.count("/") > 1:
        raise ReleaseNotFoundError(
            f"{text}: there is no such folder, and a repository is OWNER/NAME"
        )


def why_no_hub() -> str:
    """Why the Hub cannot be reached, after a few seconds; empty if it answers.

    `datasets` asks for half a minute before it says so. What answers slowly, or with an
    error, answers.
    """
    import httpx2
    from huggingface_hub import constants, get_session

    reason = ""
    limit = httpx2.Timeout(TO_ANSWER, connect=TO_CONNECT)
    for pause in (0.0, TO_ASK_AGAIN):
        time.sleep(pause)
        try:
            get_session().head(constants.ENDPOINT, timeout=limit)
        except (httpx2.ConnectError, httpx2.ConnectTimeout, ConnectionError) as error:
            reason = str(error).partition("\n")[0] or type(error).__name__
        except httpx2.HTTPError:
            return ""
        else:
            return ""
    return reason


def snapshot() -> Path | None:
    """What was downloaded of the repository on the Hub before, in its newest version.

    The files of a configuration that was loaded are there; others may be missing.
    """
    from huggingface_hub import try_to_load_from_cache

    found = try_to_load_from_cache(HUB_REPOSITORY, RECORD, repo_type="dataset")
    if not isinstance(found, str):
        return None
    folder = Path(found).parent
    return folder if is_release(folder) else None
