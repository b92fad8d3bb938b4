"""Run one program and send its frames through a pipe: the other half of `run`.

Called as `child.py PROGRAM PIPE MAX_FRAMES MEMORY STATES`. It imports nothing of the
package, so that a program runs as it would on its own. If STATES is 1, the state of the
program goes before each frame, and what never changes before the first.
"""

import ctypes
import importlib.util
import json
import os
import resource
import signal
import struct
import sys
import traceback
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

HEADER = struct.Struct("<4sIIQ")  # kind, two numbers, bytes that follow
FRAME = b"FRAM"  # height, width; uint8 RGB
CAST = b"CAST"  # particles, solids; float64, see `_cast`
STATE = b"STAT"  # living particles, substeps done; float32, see `_state`
REPORT = b"REPT"  # 0, 0; JSON
NEEDED = (
    *("AREA", "ENVIRONMENT", "MATTER", "SIMULATION"),
    *("alive", "clock", "owner", "v", "x"),
)  # what a program must have at its top for its state to be read
UNREADABLE = (AttributeError, LookupError, TypeError, ValueError, struct.error)
PR_SET_PDEATHSIG = 1
LARGEST_FILE = 64 << 20  # bytes; what a program prints goes into a file, too


Reader = Callable[[ModuleType], tuple[int, int, list[Any]]]  # see `_read_state`


class BadText(Exception):
    """The program is not Python."""


class BadFrames(Exception):
    """The program yields something that is not a frame."""


class NoFrames(Exception):
    """The program has no frames to give."""


class NoStates(Exception):
    """The program has no state that can be read."""


def main(
    path: str,
    pipe: int,
    max_frames: int,
    memory: int,
    states: bool,
    read: Reader | None = None,
) -> None:
    """Run the program at `path` and report how it ended.

    A short trial that only wants states brings its own way to read them; then nothing
    is drawn but what never moves.
    """
    _confine(memory)
    status, message = "ok", ""
    try:
        _parse(path)
        program = _load(path)
        if read:
            program.draw = _leave_black  # type: ignore[attr-defined]
        _send_frames(
            program, pipe, max_frames, (read or _read_state) if states else None
        )
    except BadText as error:
        status, message = "syntax_error", str(error)
    except ImportError as error:
        status, message = "import_error", str(error)
    except MemoryError:
        status, message = "out_of_memory", f"more than {memory >> 20} MiB"
    except BadFrames as error:
        status, message = "bad_frames", str(error)
    except NoFrames as error:
        status, message = "no_frames", str(error)
    except NoStates as error:
        status, message = "no_states", str(error)
    except Exception as error:  # noqa: BLE001 - it is reported, whatever it is
        status, where = "exception", traceback.format_exc(limit=-3)
        message = f"{type(error).__name__}: {error}\n{where}"
    payload = json.dumps({"status": status, "message": message}).encode()
    _write(pipe, HEADER.pack(REPORT, 0, 0, len(payload)) + payload)


def _confine(memory: int) -> None:
    """Die with the parent; stay within the memory allowed; fill no disk."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_FSIZE, (LARGEST_FILE, LARGEST_FILE))


def _parse(path: str) -> None:
    try:
        with open(path, encoding="utf-8") as file:
            compile(file.read(), "program.py", "exec")
    except SyntaxError as error:
        raise BadText(f"line {error.lineno}: {error.msg}") from None
    except ValueError as error:  # bytes that are no text, or a NUL
        raise BadText(str(error)) from None


def _load(path: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location("program", path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} cannot be loaded")
    program = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(program)
    return program


def _leave_black(image: Any) -> None:
    """Stand for `draw` where only the states are wanted."""


def _send_frames(
    program: ModuleType, pipe: int, max_frames: int, read: Reader | None
) -> None:
    if not callable(getattr(program, "frames", None)):
        raise NoFrames("the program defines no function frames()")
    missing = [name for name in NEEDED if not hasattr(program, name)]
    if read and missing:
        raise NoStates(f"the program has no {', '.join(missing)} at its top")
    count = 0
    for frame in _checked(program.frames()):
        if read:
            _send_state(program, pipe, count == 0, read)
        height, width = frame.shape[:2]
        _write(pipe, HEADER.pack(FRAME, height, width, frame.nbytes))
        _write(pipe, frame.tobytes())
        count += 1
        if count == max_frames:
            break
    if not count:
        raise NoFrames("frames() yields nothing")


def _send_state(program: ModuleType, pipe: int, first: bool, read: Reader) -> None:
    try:
        messages = [_state(*read(program))]
        if first:
            messages.insert(0, _cast(program))
    except UNREADABLE as error:
        kind = type(error).__name__
        raise NoStates(f"the state cannot be read: {kind}: {error}") from None
    for message in messages:
        _write(pipe, message)


def _cast(program: ModuleType) -> bytes:
    """Message: object and mass of particles and solids, inertia; gravity, time step."""
    import numpy as np

    owner = program.owner.to_numpy()
    density = np.array([matter.get("density", np.nan) for matter in program.MATTER])
    solids = getattr(program, "COLLIDERS", [])
    weights = np.full((len(solids), 2), np.inf)  # mass, inertia
    if hasattr(program, "RIGID"):
        rigid = np.isin(solids, program.RIGID)
        weights[rigid] = 1.0 / program.ease.to_numpy()[program.RIGID, :2]
    g_x, g_y = program.ENVIRONMENT["gravity"]
    rest = [g_x, g_y, program.SIMULATION["time_step_dt"]]
    mass = program.AREA * density[owner]
    numbers = np.concatenate([owner, mass, solids, *weights.T, rest])
    data: bytes = numbers.astype("<f8").tobytes()
    return HEADER.pack(CAST, len(owner), len(solids), len(data)) + data


def _read_state(program: ModuleType) -> tuple[int, int, list[Any]]:
    """Living particles n, substeps done; x, v (n, 2), pose and twist (k, 4)."""
    living, steps = int(program.alive[None]), int(program.clock[None])
    x, v = (field.to_numpy()[:living] for field in (program.x, program.v))
    if not x.shape == v.shape == (living, 2):
        shapes = f"{x.shape} and {v.shape}"
        raise ValueError(f"living x and v are {shapes}, must be {(living, 2)}")
    parts = [x, v]
    if getattr(program, "COLLIDERS", []):
        fields = program.pose, program.twist
        parts += [field.to_numpy()[program.COLLIDERS, :4] for field in fields]
    return living, steps, parts


def _state(living: int, steps: int, parts: list[Any]) -> bytes:
    """Message: the numbers that were read."""
    import numpy as np

    numbers = np.concatenate([part.ravel() for part in parts])
    data: bytes = numbers.astype("<f4").tobytes()
    return HEADER.pack(STATE, living, steps, len(data)) + data


def _checked(frames: Any) -> Iterator[Any]:
    for i, frame in enumerate(frames):
        dtype = str(getattr(frame, "dtype", None))
        shape: tuple[int, ...] = getattr(frame, "shape", ())
        if dtype != "uint8" or len(shape) != 3 or shape[2] != 3 or not frame.size:
            kind = type(frame).__name__
            raise BadFrames(
                f"frame {i} is {kind} {dtype} {tuple(shape)}, must be uint8 (H, W, 3)"
            )
        yield frame


def _write(pipe: int, data: bytes) -> None:
    view = memoryview(data)
    while view:
        view = view[os.write(pipe, view) :]


if __name__ == "__main__":
    numbers = [int(number) for number in sys.argv[2:]]
    main(sys.argv[1], numbers[0], numbers[1], numbers[2], bool(numbers[3]))
