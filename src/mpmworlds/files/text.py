"""Texts of a user: files of them, and how to show them."""

from pathlib import Path


def read_text(path: Path, what: str = "a file of text") -> str:
    """Text of a file.

    Parameters
    ----------
    path
        The file.
    what
        What it must be, for messages.

    Raises
    ------
    OSError
        If it is not there, a folder, or cannot be read.
    ValueError
        If it is not UTF-8.
    """
    try:
        return path.read_text("utf-8")
    except FileNotFoundError:
        raise FileNotFoundError(f"{path}: is not there; name {what}") from None
    except IsADirectoryError:
        raise IsADirectoryError(f"{path}: is a folder; name {what}") from None
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: is not UTF-8 text ({error.reason})") from None


def shown(text: str, longest: int) -> str:
    """A text on one line, without what a terminal would obey, cut if it is long."""
    start = text[:longest]  # a text may be huge
    if not start.isprintable():
        start = "".join(
            c if c.isprintable() else c.encode("unicode_escape").decode() for c in start
        )
    whole = len(text) <= longest and len(start) <= longest
    return start if whole else f"{start[: longest - 3]}..."
