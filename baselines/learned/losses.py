"""The journal of a training: a line for each step that was noted."""

import json
from pathlib import Path

from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.journal import read_records


def forget_after(path: Path, step: int) -> None:
    """Drop the lines of steps that will be taken again."""
    kept = [record for record in read_records(path) if record["step"] <= step]
    text = "".join(json.dumps(record) + "\n" for record in kept)
    write_atomically(path, text.encode())
