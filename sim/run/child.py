"""Run one program and send its frames through a pipe: the other half of `run`.

Called as `child.py JSON`: the arguments of `main`, and `sandbox`, the seconds on a
processor that a program which nobody here wrote may take, else null. It imports nothing
of the package, so that a program runs as it would on its own; the sandbox is loaded
from its folder. If states are asked for, the time between frames goes before the first,
and the state of the program before each.

The state is what these names at the top of a program hold, all but the first optional:
`DT`, `SUBSTEPS` (time step [s], steps of a frame); the Taichi fields `x`, `v` (places
and velocities of particles), `owner` (numbers of their objects), `mass`, `birth` (the
step before which each is born); `pose`, `twist` (center, cosine and sine of the angle
of solids; velocity, spin).
"""

import contextlib
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
REPORT = b"REPT"  # 0, 0; JSON: how it ended
SEALED = (
    b"SEAL"  # 0, 0; JSON: what the sandbox is made of, before the program is loaded
)
NEEDED = ("DT", "SUBSTEPS")  # for the state of a program to have a time
UNREADABLE = (AttributeError, LookupError, TypeError, ValueError, struct.error)
PR_SET_PDEATHSIG = 1
LARGEST_FILE = 64 << 20  # bytes
LONGEST = 8000  # characters of a message
SANDBOX = "mpmworlds_sandbox"  # name of the package `sandbox` in a child

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
    load: Callable[[str], ModuleType] | None = None,
) -> None:
    """Run the program at `path` and report how it ended.

    Parameters
    ----------
    path
        File of the program.
    pipe
        Where its frames go.
    max_frames
        Frames to send at most, 0 for all.
    memory
        Address space allowed [bytes], which `confine` has seen to.
    states
        Whether to send states, too.
    read
        How to read them. A short trial that only wants states brings its own way; then
        nothing is drawn but what never moves.
    compiler
        What the program gets as `taichi`, see `sim.run.compilers`.
    load
        How to load it, if not by itself.
    """
    status, message = "ok", ""
    try:
        _parse(path)
        _stand_in_for_taichi(compiler)
        program = (load or _load)(path)
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
        if _is_sealed() and isinstance(error, PermissionError):
            status = "forbidden"
        message = f"{type(error).__name__}: {error}\n{where}"
    _send_json(pipe, REPORT, {"status": status, "message": message[:LONGEST]})


def _send_json(pipe: int, kind: bytes, content: dict[str, Any]) -> None:
    payload = json.dumps(content).encode()
    _write(pipe, HEADER.pack(kind, 0, 0, len(payload)) + payload)


def confine(memory: int) -> None:
    """Die with the parent; stay within the memory allowed; fill no disk."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        _limit(resource.RLIMIT_AS, memory)
    _limit(resource.RLIMIT_CORE, 0)
    _limit(resource.RLIMIT_FSIZE, LARGEST_FILE)


def _limit(what: int, value: int) -> None:
    """Lower a limit, as far as the user's shell has not lowered it further."""
    _, hard = resource.getrlimit(what)
    value = value if hard == resource.RLIM_INFINITY else min(value, hard)
    resource.setrlimit(what, (value, value))


def seal(path: str, pipe: int, seconds: int, compiler: str) -> None:
    """Lock this process up, with what programs import in it, and say so.

    What cannot be imported is left to the program, which then finds out.
    """
    lockdown = _load_sandbox()
    folder = os.path.dirname(os.path.abspath(path))
    found = lockdown.places(folder)
    layers = lockdown.namespaces.enter(folder, found.trees, found.hidden, [pipe])
    if "mount" in layers:
        os.environ["HOME"] = os.environ["TMPDIR"] = lockdown.namespaces.WRITABLE
    for name in ("numpy", compiler):
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    _force_settings(sys.modules.get(compiler))
    _send_json(pipe, SEALED, lockdown.lock(found, seconds, [pipe], layers))


def _load_sandbox() -> Any:
    """The package beside this file, without the package that both belong to."""
    folder = _beside("sandbox")
    spec = importlib.util.spec_from_file_location(
        SANDBOX,
        os.path.join(folder, "__init__.py"),
        submodule_search_locations=[folder],
    )
    if spec is None or spec.loader is None:
        raise ImportError(f"{folder} cannot be loaded")
    package = importlib.util.module_from_spec(spec)
    sys.modules[SANDBOX] = package
    spec.loader.exec_module(package)
    return importlib.import_module(f"{SANDBOX}.lockdown")


def _beside(name: str) -> str:
    return os.path.join(os.path.dirname(os.path.abspath(__file__)), name)


def _is_sealed() -> bool:
    return SANDBOX in sys.modules


def _force_settings(compiler: Any) -> None:
    """One thread and no cache of kernels: a program's own settings would win."""
    if compiler is None:
        return
    start = compiler.init

    def init(*arguments: Any, **settings: Any) -> Any:
        forced = {"cpu_max_num_threads": 1, "offline_cache": False}
        return start(*arguments, **(settings | forced))

    compiler.init = init


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


def _load(path: str, name: str = "program") -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, path)
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


def begin(given: dict[str, Any]) -> None:
    """Confine this process, lock it up if need be, and run the program."""
    seconds, compiler = given.pop("sandbox"), given["compiler"]
    confine(given["memory"])
    quick = _load(_beside("quick.py"), "quick")  # which a sealed process cannot read
    if seconds is not None:
        seal(given["path"], given["pipe"], seconds, compiler)
    if compiler == "taichi" and _names_taichi(given["path"]):
        with contextlib.suppress(ImportError):
            quick.quicken()
    main(**given)


def _names_taichi(path: str) -> bool:
    with open(path, "rb") as file:
        return b"taichi" in file.read()


if __name__ == "__main__":
    begin(json.loads(sys.argv[1]))
