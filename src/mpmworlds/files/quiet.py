"""Nothing on standard error, for libraries that write there past Python."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

_ERRORS: Final = 2  # descriptor of standard error


@contextmanager
def errors_unsaid() -> Iterator[None]:
    """Send what this process writes to standard error nowhere, for a while.

    OpenCV's writers of videos print there whatever its level of logging is.
    """
    nowhere, kept = os.open(os.devnull, os.O_WRONLY), os.dup(_ERRORS)
    try:
        os.dup2(nowhere, _ERRORS)
        yield
    finally:
        os.dup2(kept, _ERRORS)
        os.close(kept)
        os.close(nowhere)
