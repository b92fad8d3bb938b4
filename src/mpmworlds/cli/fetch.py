"""The verb that gets single samples of a release."""

import argparse
from pathlib import Path
from typing import Any

from mpmworlds.cli.common import DONE, WHOSE, new_verb, say_where
from mpmworlds.files.targets import check_folder

_FILES = {  # column -> name of its file
    "scene": "scene.yaml",
    "program": "program.py",
    "video": "video.mp4",
    "clip": "clip.mp4",
}


def add_fetch(verbs: Any) -> None:
    """Add the verb `fetch`."""
    parser = new_verb(
        verbs,
        fetch,
        "get single samples of a release, here or on the Hub, without all the others",
        "mpmworlds fetch p0123-c4 --release mpmworlds/mpmworlds --out samples",
    )
    parser.description += f" {WHOSE}"
    parser.add_argument("id", nargs="+", metavar="ID", help="ids of samples")
    parser.add_argument(
        "--release",
        help="folder or repository (default: what load_dataset('mpmworlds') finds)",
    )
    parser.add_argument(
        "--revision",
        help="version of a repository: of the one on the Hub, if none is named",
    )
    parser.add_argument(
        "--config",
        help="configuration (default: the first with videos that has all of them, "
        "those of the corpus full before others)",
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("samples"),
        help="a folder for each sample goes in here, with scene.yaml, program.py, "
        "video.mp4 and clip.mp4 (default samples)",
    )


def fetch(options: argparse.Namespace) -> int:
    """Get single samples."""
    from mpmworlds.files.atomic import write_atomically
    from mpmworlds.loaders.locate import resolve
    from mpmworlds.loaders.places import find_rows

    check_folder(options.out)
    place = options.release or resolve(options.revision)
    found = find_rows(place, options.id, options.config, options.revision)
    for row in found.rows:
        folder = options.out / row["id"]
        for column, name in _FILES.items():
            if (value := row.get(column)) is not None:
                data = value.encode() if isinstance(value, str) else value["bytes"]
                write_atomically(folder / name, data)
        print(folder)
        others = () if options.config else found.namesakes(row["id"])
        say_where(row["id"], f"{found.config} of {place}", others)
    return DONE
