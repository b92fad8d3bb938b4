"""Run one program and send its frames through a pipe: the other half of `run`.

Called as `child.py PROGRAM COMPILER PIPE MAX_FRAMES MEMORY STATES`. It imports nothing
of the package, so that a program runs as it would on its own. COMPILER is the module
that it gets as `taichi`. If STATES is 1, the time between frames goes before the first,
and the state of the program before each.

The state is what these names at the top of a program hold, all but the first optional:
`DT`, `SUBSTEPS` (time step [s], steps of a frame); the Taichi fields `x`, `v` (places
and velocities of particles), `owner` (numbers of their objects), `mass`, `birth` (the
step before which each is born); `pose`, `twist` (center, cosine and sine of the angle
of solids; velocity, spin).
"""

import ctypes
import importlib
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
TIME = b"TIME"  # 0, 0; float64, simulated time between frames [s]
STATE = b"STAT"  # particles, solids; float32, see `_state`
REPORT = b"REPT"  # 0, 0; JSON
NEEDED = ("DT", "SUBSTEPS")  # for the state of a program to have a time
UNREADABLE = (AttributeError, LookupError, TypeError, ValueError, struct.error)
PR_SET_PDEATHSIG = 1
LARGEST_FILE = 64 << 20  # bytes; what a program prints goes into a file, too


Reader = Callable[[ModuleType, int], tuple[int, int, list[Any]]]  # see `_read_state`


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
    compiler: str = "taichi",
) -> None:
    """Run the program at `path` and report how it ended.

    A short trial that only wants states brings its own way to read them; then nothing
    is drawn but what never moves.
    """
    _confine(memory)
    status, message = "ok", ""
    try:
        _parse(path)
        _stand_in_for_taichi(compiler)
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


def _stand_in_for_taichi(compiler: str) -> None:
    """Let a program that imports Taichi get another module, and all that is in it."""
    if compiler == "taichi":
        return
    importlib.import_module(compiler)
    for name, module in list(sys.modules.items()):
        if name == compiler or name.startswith(f"{compiler}."):
            sys.modules["taichi" + name.removeprefix(compiler)] = module


def _load(path: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location("program", path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} cannot be loaded")
    program = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(program)
    return program


def _leave_black(*image: Any) -> None:
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
            _send_state(program, pipe, count, read)
        height, width = frame.shape[:2]
        _write(pipe, HEADER.pack(FRAME, height, width, frame.nbytes))
        _write(pipe, frame.tobytes())
        count += 1
        if count == max_frames:
            break
    if not count:
        raise NoFrames("frames() yields nothing")


def _send_state(program: ModuleType, pipe: int, frame: int, read: Reader) -> None:
    try:
        messages = [_state(*read(program, program.SUBSTEPS * frame - 1))]
        if frame == 0:
            data = struct.pack("<d", program.DT * program.SUBSTEPS)
            messages.insert(0, HEADER.pack(TIME, 0, 0, len(data)) + data)
    except UNREADABLE as error:
        kind = type(error).__name__
        raise NoStates(f"the state cannot be read: {kind}: {error}") from None
    for message in messages:
        _write(pipe, message)


def _read_state(program: ModuleType, step: int) -> tuple[int, int, list[Any]]:
    """State after a step: particles n, solids k, and numbers of both.

    They are x, v (n, 2), owner, mass (n,), pose (k, 4), twist (k, 3). The owner is
    -1 - number before birth; the mass is NaN where the program does not say.
    """
    import numpy as np

    def values(name: str, *shape: int) -> Any:
        field = getattr(program, name, None)
        found = field.to_numpy() if field is not None else np.zeros((0, *shape))
        if found.shape[1:] != shape:
            raise ValueError(f"{name} has shape {found.shape}, must be (n, {shape})")
        return found

    def numbers(name: str, default: float) -> Any:
        found = values(name) if hasattr(program, name) else np.full(len(x), default)
        if len(found) != len(x):
            raise ValueError(f"{name} has length {len(found)}, must be {len(x)} as x")
        return found

    x, v, pose, twist = (
        values(*what) for what in (("x", 2), ("v", 2), ("pose", 4), ("twist", 3))
    )
    if len(x) != len(v) or len(pose) != len(twist):
        lengths = f"{len(x)} and {len(v)}, pose and twist {len(pose)} and {len(twist)}"
        raise ValueError(f"x and v have lengths {lengths}; must be the same")
    owner, mass, birth = (
        numbers(*what) for what in (("owner", 0), ("mass", np.nan), ("birth", -1))
    )
    owner = np.where(birth > step, -1 - owner, owner)
    return len(x), len(pose), [x, v, owner, mass, pose, twist]


def _state(particles: int, solids: int, parts: list[Any]) -> bytes:
    """Message: the numbers that were read."""
    import numpy as np

    numbers = np.concatenate([part.ravel() for part in parts])
    data: bytes = numbers.astype("<f4").tobytes()
    return HEADER.pack(STATE, particles, solids, len(data)) + data


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
    program, compiler = sys.argv[1:3]
    pipe, max_frames, memory, states = (int(number) for number in sys.argv[3:])
    main(program, pipe, max_frames, memory, bool(states), compiler=compiler)
