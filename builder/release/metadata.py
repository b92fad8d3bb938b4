"""What a release tells machines besides `load_dataset`: croissant.json, eval.yaml."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from mpmworlds.builder.release.croissant import CroissantFile, croissant_text
from mpmworlds.builder.release.features import columns_of
from mpmworlds.builder.release.layout import Record
from mpmworlds.builder.release.leaderboard import leaderboard_text
from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.checksums import files_below, sha256_of_file

CROISSANT: Final = "croissant.json"
LEADERBOARD: Final = "eval.yaml"


def write_metadata(out_dir: Path, record: Record, known: Mapping[str, str]) -> None:
    """Write both files, when all others but SHA256SUMS are there.

    Parameters
    ----------
    out_dir
        Folder of the release.
    record
        What the release consists of.
    known
        Path -> SHA-256 of files that need not be hashed again.
    """
    splits = {
        name: list(dict.fromkeys(file.split for file in config.files))
        for name, config in record.configs.items()
    }
    tasks = leaderboard_text(splits)
    if tasks is None:
        (out_dir / LEADERBOARD).unlink(missing_ok=True)
    else:
        write_atomically(out_dir / LEADERBOARD, tasks.encode())
    files = [
        CroissantFile(
            name,
            (out_dir / name).stat().st_size,
            known.get(name) or sha256_of_file(out_dir / name),
        )
        for name in files_below(out_dir)
        if name != CROISSANT
    ]
    columns = {name: columns_of(name) for name in record.configs}
    text = croissant_text(record.version, files, columns)
    write_atomically(out_dir / CROISSANT, text.encode())
