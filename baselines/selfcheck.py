"""What is checked before anything is scored: this machine gives the scores it must.

The program of a sample must give its video, a broken one must fail, and one that tries
to get out of the sandbox must not.
"""

from typing import Final

import numpy as np

from mpmworlds.loaders.load import Example
from mpmworlds.metrics import SCORED, score
from mpmworlds.metrics.reduction import prefix_length, reduce_clip
from mpmworlds.sim.run.run import SandboxError, run

BROKEN: Final = "def frames():\n    yield 1 / 0\n"
# A pixel for each way out; 255 where it leads out.
CANARY: Final = """\
import os
import socket
import numpy as np


def leads_out(way):
    try:
        way()
    except Exception:
        return 0
    return 255


def reads():
    return os.listdir(os.path.expanduser("~root")) and open("/etc/passwd").read()


def writes():
    open("/var/tmp/mpmworlds-canary", "w").close()


def connects():
    socket.create_server(("127.0.0.1", 0))


def starts():
    os.fork() or os._exit(0)


def frames():
    ways = [leads_out(way) for way in (reads, writes, connects, starts)]
    yield np.array(ways, np.uint8).reshape(1, 4, 1).repeat(3, 2)
"""


_CHECKED: Final[set[tuple[str, bool]]] = set()  # by this process


class SelfCheckError(RuntimeError):
    """Scores that are computed here would be wrong."""


def self_check(example: Example, *, sandbox: bool = True) -> None:
    """Check with a sample of the release that this machine can be believed, once.

    Parameters
    ----------
    example
        A sample with its program.
    sandbox
        Whether programs are to be confined.

    Raises
    ------
    SelfCheckError
        If the program of the sample does not give its video, or a broken one does not
        fail.
    SandboxError
        If the sandbox does not hold.
    """
    program = str(example.row["program"])
    if (program, sandbox) in _CHECKED:
        return
    rate = int(example.row["framerate"])
    outcome = run(program, prefix_length(rate), trusted=not sandbox)
    if outcome.status != "ok":
        raise SelfCheckError(
            f"{example.id}: its own program ended in {outcome.status} here "
            f"({outcome.message}); see mpmworlds doctor"
        )
    drawn = reduce_clip(outcome.frames, rate)
    if not np.array_equal(drawn, example.prefix):
        alike = drawn.shape == example.prefix.shape
        how = score(drawn, example.prefix) if alike else f"shape {drawn.shape}"
        raise SelfCheckError(
            f"{example.id}: its own program draws another video here "
            f"({how}); compare the versions of taichi, numpy and "
            "opencv-python-headless with those of the release, and see mpmworlds doctor"
        )
    perfect = {name: metric.best for name, metric in SCORED.items()}
    own = score(drawn, example.prefix)
    if any(own[n] != perfect[n] for n in perfect if SCORED[n].needs_reference):
        raise SelfCheckError(f"{example.id}: the truth itself scores {own}")
    broken = run(BROKEN, trusted=not sandbox)
    if broken.status != "exception":
        raise SelfCheckError(f"a broken program ended in {broken.status}")
    if sandbox:
        check_sandbox()
    _CHECKED.add((program, sandbox))


def check_sandbox() -> None:
    """Check that a program does not get out of the sandbox.

    Raises
    ------
    SandboxError
        If it does, or there is none.
    """
    outcome = run(CANARY)
    if outcome.status == "forbidden":
        return
    if outcome.status != "ok" or outcome.frames.any():
        raise SandboxError(
            "the sandbox does not hold here: a program that tries to get out ended in "
            f"{outcome.status} {outcome.frames[:, 0, :, 0].tolist()}; see mpmworlds "
            "doctor"
        )
