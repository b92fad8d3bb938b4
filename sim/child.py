"""Run one program and send its frames through a pipe: the other half of `run`.

Called as `child.py PROGRAM PIPE MAX_FRAMES MEMORY`. It imports nothing of the package,
so that a program runs as it would on its own.
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
from collections.abc import Iterator
from types import ModuleType
from typing import Any

HEADER = struct.Struct("<4sIIQ")  # kind, height, width, bytes that follow
FRAME = b"FRAM"
REPORT = b"REPT"
PR_SET_PDEATHSIG = 1
LARGEST_FILE = 64 << 20  # bytes; what a program prints goes into a file, too


class BadText(Exception):
    """The program is not Python."""


class BadFrames(Exception):
    """The program yields something that is not a frame."""


class NoFrames(Exception):
    """The program has no frames to give."""


def main(path: str, pipe: int, max_frames: int, memory: int) -> None:
    """Run the program at `path` and report how it ended."""
    _confine(memory)
    status, message = "ok", ""
    try:
        _parse(path)
        _send_frames(_load(path), pipe, max_frames)
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


def _send_frames(program: ModuleType, pipe: int, max_frames: int) -> None:
    if not callable(getattr(program, "frames", None)):
        raise NoFrames("the program defines no function frames()")
    count = 0
    for frame in _checked(program.frames()):
        height, width = frame.shape[:2]
        _write(pipe, HEADER.pack(FRAME, height, width, frame.nbytes))
        _write(pipe, frame.tobytes())
        count += 1
        if count == max_frames:
            break
    if not count:
        raise NoFrames("frames() yields nothing")


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
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]))
