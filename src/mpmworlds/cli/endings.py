"""What asks a command to end, as an exception, so that it tidies up first."""

import math
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

ENDINGS: Final = tuple(  # those that this system has
    signal.Signals[name]
    for name in ("SIGTERM", "SIGHUP")
    if name in signal.Signals.__members__
)
GRACE: Final = 5.0  # seconds to tidy up: a terminal that closes hangs up twice


class Ended(BaseException):
    """The command was asked to end.

    Attributes
    ----------
    number
        Number of the signal.
    """

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.number = number


@contextmanager
def endings_raised() -> Iterator[None]:
    """Raise `Ended` where a signal would end this process at once.

    What is ignored stays so, as a hangup under `nohup`.
    """
    last = -math.inf

    def end(number: int, _frame: FrameType | None) -> None:
        nonlocal last
        if time.monotonic() - last >= GRACE:
            last = time.monotonic()
            raise Ended(number)

    mine = threading.current_thread() is threading.main_thread()
    taken = [n for n in ENDINGS if mine and signal.getsignal(n) == signal.SIG_DFL]
    for number in taken:
        signal.signal(number, end)
    try:
        yield
    finally:
        for number in taken:
            signal.signal(number, signal.SIG_DFL)
