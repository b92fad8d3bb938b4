"""The transcript: every request and its reply, so that nothing is asked twice.

JSON Lines, one object per request. Each is on the disk before the next request is sent;
a line that was not written whole is dropped, and its request is asked again.
"""

import json
import logging
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from mpmworlds.files.closeable import Closeable
from mpmworlds.files.journal import Journal, JournalBusyError

log = logging.getLogger(__name__)


class TranscriptError(ValueError):
    """A file that is no transcript, or that another process is writing."""


@dataclass(frozen=True)
class Exchange:
    """A request and its reply.

    Attributes
    ----------
    key
        Key of the request.
    request
        What was sent, without the secret.
    reply
        What came back.
    retries
        Failed attempts before it came.
    structured
        Whether the model was kept to the schema of scenes.
    """

    key: str
    request: dict[str, Any]
    reply: dict[str, Any]
    retries: int
    structured: bool = False


class Transcript(Closeable):
    """A transcript open for going on with, held by one process at a time.

    Parameters
    ----------
    path
        File to go on with; made if it is not there.

    Raises
    ------
    TranscriptError
        If it is damaged elsewhere than at its end, or is being written by another
        process.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._known: dict[str, Exchange] = {}
        try:
            self._journal = Journal(path)
        except JournalBusyError as error:
            raise TranscriptError(f"{error}, or name another transcript") from error
        try:
            self._recover()
        except BaseException:
            self._journal.close()
            raise

    def close(self) -> None:
        """Let go of the file."""
        self._journal.close()

    def __len__(self) -> int:
        return len(self._known)

    def get(self, key: str) -> Exchange | None:
        """Exchange of a request, or None if it has not been answered."""
        return self._known.get(key)

    def append(self, exchange: Exchange) -> None:
        """Record an exchange; on return it is on the disk."""
        line = json.dumps(asdict(exchange), sort_keys=True) + "\n"
        self._journal.append(line)
        self._known[exchange.key] = exchange

    def _recover(self) -> None:
        """Read what is there, and cut off a line that was not written whole."""
        whole = 0
        for number, line, end in self._journal.lines():
            exchange = self._parse(number, line)
            self._known[exchange.key] = exchange
            whole = end
        dropped = self._journal.cut(whole)
        if dropped:
            log.warning(
                "%s: the last reply was not written whole; its %d bytes are dropped, "
                "and it is asked for again",
                self.path,
                dropped,
            )

    def _parse(self, number: int, line: bytes) -> Exchange:
        try:
            exchange = Exchange(**json.loads(line))
            sound = isinstance(exchange.reply["choices"], list)
        except (ValueError, TypeError, KeyError):
            sound = False
        if not sound:
            raise TranscriptError(
                f"{self.path}: line {number} is no request with its reply; remove the "
                "line, or name another transcript"
            )
        return exchange
