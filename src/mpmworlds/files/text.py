"""Text files of a user."""

from pathlib import Path


def read_text(path: Path) -> str:
    """Text of a file; raises `ValueError` if it is not UTF-8."""
    try:
        return path.read_text("utf-8")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: is not UTF-8 text ({error.reason})") from None
