"""Run a program in a process of its own and bring back its frames.

What simulates is the released text itself: it is written to a file, run by a fresh
interpreter on one CPU thread, and its frames come back through a pipe. Whatever the
program does, the caller gets an `Outcome`, in time. A text that the linker did not
write just now is run in a sandbox, see `sim.run.sandbox`.
"""

from mpmworlds.sim.run.process import MEMORY
from mpmworlds.sim.run.receive import Outcome, RunError, Watch
from mpmworlds.sim.run.running import TIMEOUT, Running, SandboxError

__all__ = ["MEMORY", "TIMEOUT", "Outcome", "RunError", "SandboxError", "run"]


def run(
    program_text: str,
    max_frames: int | None = None,
    timeout: float = TIMEOUT,
    memory: int = MEMORY,
    *,
    states: bool = False,
    compiler: str = "taichi",
    trusted: bool = False,
    watch: Watch | None = None,
) -> Outcome:
    """Run a program and collect its frames.

    Parameters
    ----------
    program_text : str
        A Python file with a `frames()` generator of uint8 (H, W, 3) RGB frames.
    max_frames : int, optional
        Stop after so many frames.
    timeout : float
        Wall time allowed [s].
    memory : int
        Address space allowed [bytes].
    states : bool
        Read the state of matter and solids at every frame, too; the frames are the
        same. It takes a few names at the top of the program, see `sim.run.child`.
    compiler : str
        What the program gets as `taichi`, see `sim.run.compilers`.
    trusted : bool
        Run it without a sandbox. For the text that `link` returns; any other one can do
        then what you can.
    watch : callable, optional
        Asked after every frame, with the list of all so far, whether to go on; if not,
        the run ends well, with those frames.

    Returns
    -------
    Outcome
        Never raises for anything that the program does.

    Raises
    ------
    ValueError, RuntimeError
        If there is no such compiler, it is not installed, or the shell allows a process
        too little memory to run any.
    SandboxError
        If this machine cannot confine a program that is not trusted.
    """
    with Running(
        program_text,
        max_frames,
        timeout,
        memory,
        states=states,
        compiler=compiler,
        trusted=trusted,
    ) as running:
        return running.go_on(watch)
