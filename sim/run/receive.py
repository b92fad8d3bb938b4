"""What comes from a program, read with a bound on everything and trusted in nothing.

A program shares its process with what sends its frames, and may send what it likes: a
message is taken for what it claims only after a look at it.
"""

import json
import os
import select
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Literal, cast, get_args

import numpy as np
import numpy.typing as npt

from mpmworlds.sim.run.child import FRAME, HEADER, REPORT, SEALED, STATE, TIME
from mpmworlds.sim.run.process import Process
from mpmworlds.sim.run.track import Recording, Track

Status = Literal[
    "ok",  # frames are complete
    "syntax_error",  # the text is not Python
    "import_error",  # it imports what is not there
    "exception",  # it raised
    "crash",  # a signal ended it, for example an index off the grid
    "killed",  # something else ended it, perhaps for lack of memory
    "timeout",  # it did not end in time
    "out_of_memory",  # it asked for more memory than it may have
    "no_frames",  # it has no frames() or yields nothing
    "bad_frames",  # a frame is not uint8 (H, W, 3), or not like the first
    "no_states",  # states were asked for, and it has none that can be read
    "forbidden",  # it tried what the sandbox forbids
    "too_much_output",  # it printed or drew more than anybody wants to keep
    "bad_message",  # it sent something else than frames
]
STATUSES: Final = frozenset(get_args(Status))
TAIL: Final = 2000  # characters kept of what a failed program printed
LARGEST_SIDE: Final = 1 << 14  # pixels of a frame
LARGEST_REPORT: Final = 1 << 16  # bytes
LARGEST_SUM: Final = 1 << 30  # bytes of frames and states
MOST_PRINTED: Final = 16 << 20  # bytes
OFTEN: Final = 0.2  # seconds between looks at whether the process lives
CHUNK: Final = 1 << 20  # bytes read at once

Verdict = tuple[Status, str]
Frame = npt.NDArray[np.uint8]
Watch = Callable[[list[Frame]], bool]
Keep = Callable[[int, Frame], Frame | None]


class Refused(Exception):
    """A message that is not taken; its verdict."""

    def __init__(self, status: Status, message: str) -> None:
        super().__init__(message)
        self.verdict: Verdict = status, message


@dataclass(frozen=True)
class Outcome:
    """How a run ended.

    Attributes
    ----------
    status : str
        "ok" or the kind of failure.
    frames : ndarray of uint8, shape (T, H, W, 3)
        RGB frames up to the end or the failure; T may be 0.
    seconds : float
        Wall time.
    message : str
        What went wrong, empty if nothing did.
    states : Track, optional
        Those of all frames, if they were asked for and there are any.
    sandbox : mapping, optional
        What confined the program, see `sim.run.sandbox.lockdown.lock`; None if nothing
        did.
    """

    status: Status
    frames: npt.NDArray[np.uint8]
    seconds: float
    message: str
    states: Track | None = None
    sandbox: Mapping[str, Any] | None = None

    def expect(self) -> npt.NDArray[np.uint8]:
        """The frames of a run that must have ended well; raises `RunError`."""
        if self.status != "ok":
            raise RunError(f"the program ended in {self.status}: {self.message}")
        return self.frames


class RunError(RuntimeError):
    """A program that was needed did not end well."""


class Channel:
    """The end of a pipe from a program, and of another one for what it prints.

    Parameters
    ----------
    messages, printed
        The pipes to read from; there may be none for what is printed.
    deadline
        When to give up, by `time.monotonic`.
    process
        The program's; what a process that has ended leaves open is not waited for.
    """

    def __init__(
        self,
        messages: int,
        deadline: float,
        printed: int | None = None,
        process: Process | None = None,
    ) -> None:
        self.deadline = deadline
        self._messages = messages
        self._printed = printed
        self._process = process
        self._tail = b""
        self._count = 0

    def read(self, length: int) -> bytearray:
        """Up to so many bytes of messages, fewer only at their end.

        Raises
        ------
        TimeoutError
            Past the deadline.
        Refused
            If it prints too much.
        """
        data = bytearray()
        while len(data) < length:
            ended = self._process is not None and self._process.poll() is not None
            ready = self._wait(0.0 if ended else OFTEN)
            if self._printed in ready:
                self._take_print()
            if self._messages in ready:
                chunk = os.read(self._messages, min(length - len(data), CHUNK))
                if not chunk:
                    break
                data += chunk
            elif ended and not ready:
                break
        return data

    def _wait(self, most: float) -> list[int]:
        left = self.deadline - time.monotonic()
        if left <= 0:
            raise TimeoutError
        pipes = [p for p in (self._messages, self._printed) if p is not None]
        return select.select(pipes, [], [], min(left, most))[0]

    def _take_print(self) -> None:
        if self._printed is None:
            return
        chunk = os.read(self._printed, CHUNK)
        if not chunk:
            self._printed = None
        self._tail = (self._tail + chunk)[-4 * TAIL :]
        self._count += len(chunk)
        if self._count > MOST_PRINTED:
            raise Refused("too_much_output", f"it printed {self._count >> 20} MiB")

    def wait_for_end(self) -> None:
        """Read on until the process has ended; raises as `read` does."""
        while self._process is not None and self._process.poll() is None:
            if not self.read(CHUNK):
                time.sleep(0.001)

    def tail(self) -> str:
        """The end of what was printed."""
        while self._printed is not None:
            if not select.select([self._printed], [], [], 0.0)[0]:
                break
            try:
                self._take_print()
            except Refused:
                break
        return printable(self._tail.decode("utf-8", "replace"))[-TAIL:].strip()


def printable(text: str) -> str:
    """A text of a program without what a terminal would obey."""
    return "".join(c if c.isprintable() or c in "\n\t" else "?" for c in text)


@dataclass
class Received:
    """What has come through the pipe.

    Attributes
    ----------
    most
        Frames that were asked for, at most; 0 for all.
    watch
        Asked after every frame, with all so far, whether to go on.
    keep
        What to keep of a frame, of its number and itself; None for nothing of it.
    waits
        Whether it was told not to go on.
    frames, recording
        The frames, as they are kept, and the states.
    count, shape
        Frames that came, and the shape of the first.
    seal
        What the sandbox says it is made of, before the program begins.
    """

    most: int = 0
    watch: Watch | None = None
    keep: Keep | None = None
    waits: bool = False
    count: int = 0
    shape: tuple[int, ...] = ()
    frames: list[Frame] = field(default_factory=list)
    recording: Recording = field(default_factory=Recording)
    seal: dict[str, Any] | None = None
    size: int = 0

    def outcome(self, status: Status, message: str, seconds: float) -> Outcome:
        """All of it, with how the run ended."""
        frames = self.frames
        stack = np.stack(frames) if frames else np.zeros((0, 0, 0, 3), np.uint8)
        found = self.recording.track(self.count)
        return Outcome(status, stack, seconds, message, found, self.seal)


def collect(channel: Channel, received: Received) -> Verdict | None:
    """Read messages until they end; a verdict if the child sent one.

    Raises
    ------
    TimeoutError
        Past the deadline of the channel.
    """
    try:
        while header := channel.read(HEADER.size):
            if len(header) < HEADER.size:
                return None
            kind, one, other, length = HEADER.unpack(header)
            if kind not in _TAKE:
                raise Refused("bad_message", f"it sent a message of kind {kind!r}")
            check, take = _TAKE[kind]
            check(received, one, other, length)
            received.size += length
            if received.size > LARGEST_SUM:
                raise Refused(
                    "too_much_output", f"it drew more than {LARGEST_SUM >> 30} GiB"
                )
            payload = channel.read(length)
            if len(payload) < length:
                return None
            verdict = take(received, one, other, payload)
            if verdict:
                return verdict
    except Refused as refused:
        return refused.verdict
    return None


def _check_frame(received: Received, height: int, width: int, length: int) -> None:
    count = received.count
    sides = 1 <= height <= LARGEST_SIDE and 1 <= width <= LARGEST_SIDE
    if not sides or length != 3 * height * width:
        raise Refused(
            "bad_frames",
            f"frame {count} is {(height, width)} of {length} bytes, must have sides of "
            f"1 to {LARGEST_SIDE} px and 3 bytes a pixel",
        )
    if received.shape not in ((), (height, width, 3)):
        size = received.shape[:2]
        raise Refused(
            "bad_frames",
            f"frame {count} is {(height, width)}, must be {size} like frame 0",
        )
    if received.most and count >= received.most:
        raise Refused("bad_message", f"it sent more than {received.most} frames")


def _take_frame(
    received: Received, height: int, width: int, payload: bytearray
) -> Verdict | None:
    frame = np.frombuffer(payload, np.uint8).reshape(height, width, 3)
    kept = received.keep(received.count, frame) if received.keep else frame
    if kept is not None:
        received.frames.append(kept)
    received.count, received.shape = received.count + 1, frame.shape
    received.waits = bool(received.watch and not received.watch(received.frames))
    return ("ok", "") if received.waits else None


def _check_time(received: Received, _one: int, _other: int, length: int) -> None:
    if length != 8 or received.count:
        raise Refused("bad_message", "it sent a time that is none")


def _take_time(
    received: Received, _one: int, _other: int, payload: bytearray
) -> Verdict | None:
    received.recording.begin(payload)
    return None


def _check_state(_received: Received, particles: int, solids: int, length: int) -> None:
    if length != 4 * (6 * particles + 7 * solids):
        raise Refused("bad_message", "it sent a state that is none")


def _take_state(
    received: Received, particles: int, solids: int, payload: bytearray
) -> Verdict | None:
    if received.recording.add(particles, solids, payload):
        return None
    return "no_states", (
        f"the state of frame {received.count} has another size than that of frame 0"
    )


def _check_json(_received: Received, _one: int, _other: int, length: int) -> None:
    if length > LARGEST_REPORT:
        raise Refused("bad_message", f"it sent a report of {length} bytes")


def _take_report(
    received: Received, _one: int, _other: int, payload: bytearray
) -> Verdict | None:
    report = _read_json(payload)
    status, message = report.get("status"), report.get("message")
    if status not in STATUSES or not isinstance(message, str):
        raise Refused("bad_message", "it sent a report that is none")
    if status == "ok" and not received.count:
        return "no_frames", "it claims to have ended well, without a frame"
    return cast("Status", status), printable(message)


def _check_seal(received: Received, one: int, other: int, length: int) -> None:
    if received.size:
        raise Refused("bad_message", "it claims to be sealed, too late")
    _check_json(received, one, other, length)


def _take_seal(
    received: Received, _one: int, _other: int, payload: bytearray
) -> Verdict | None:
    received.seal = _read_json(payload)
    return None


def _read_json(payload: bytearray) -> dict[str, Any]:
    try:
        found = json.loads(payload)
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise Refused("bad_message", "it sent a report that is none")
    return found


_TAKE: Final[
    dict[
        bytes,
        tuple[
            Callable[[Received, int, int, int], None],
            Callable[[Received, int, int, bytearray], Verdict | None],
        ],
    ]
] = {
    FRAME: (_check_frame, _take_frame),
    TIME: (_check_time, _take_time),
    STATE: (_check_state, _take_state),
    REPORT: (_check_json, _take_report),
    SEALED: (_check_seal, _take_seal),
}
