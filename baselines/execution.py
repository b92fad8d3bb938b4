"""Candidates that must be run: programs in a sandbox, scenes as their own programs."""

import time
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Final

import numpy as np

from mpmworlds.baselines.protocol import (
    Failure,
    InfrastructureError,
    ProgramText,
    SceneText,
)
from mpmworlds.files.closeable import Closeable
from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.metrics.reduction import (
    FRAMERATE,
    Frames,
    is_kept,
    reduce_clip,
)
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.forkserver import ForkServer
from mpmworlds.sim.run.run import Outcome, run
from mpmworlds.sim.run.running import Running
from mpmworlds.sim.scene.scene import Scene

LEAST_TIME: Final = 60.0  # seconds that any program may take
TIMES_REFERENCE: Final = 4  # what a program may take of the reference's own time here
LOOKS: Final = (10, 19, 28)  # frames of the prefix at which a loser may be stopped


@dataclass(frozen=True)
class Runnable:
    """A program that is to be run."""

    text: str
    trusted: bool


def runnable(answer: ProgramText | SceneText, form: VideoForm) -> Runnable | Failure:
    """The program of an answer, or why there is none."""
    if isinstance(answer, ProgramText):
        return Runnable(answer.text, trusted=False)
    try:
        scene = Scene.from_yaml(answer.text, "scene")
    except ValueError as error:
        return Failure("invalid_scene", str(error))
    output = scene.output
    frames = scene.simulation.duration_frames
    found = VideoForm(frames, output.framerate, output.resolution)
    if found != form:
        return Failure("wrong_form", f"the scene's output is {found}, must be {form}")
    return Runnable(link(scene), trusted=True)


class Runs(Closeable):
    """Runs of the candidates of one sample, each text once.

    What was run as far as the prefix waits there, to go on to the end or to be dropped.

    Parameters
    ----------
    form
        What frames are wanted.
    known
        Frames of the prefix, as it is evaluated.
    reference
        Text of the sample's scene, by whose own time others are limited.
    sandbox
        Whether programs that were not linked here are confined.
    """

    def __init__(
        self, form: VideoForm, known: int, reference: str, *, sandbox: bool = True
    ) -> None:
        self._form = form
        self._known = known
        self._reference = reference
        self._sandbox = sandbox
        self.seconds = 0.0
        """Seconds that programs have taken so far."""
        self._limit: float | None = None
        self._server: ForkServer | None = None
        self._waiting: dict[Runnable, Running] = {}
        self._begun: dict[Runnable, Frames | Failure] = {}
        self._whole: dict[Runnable, Frames | Failure] = {}

    def begin(
        self, program: Runnable, hopeless: Callable[[Frames], bool] | None = None
    ) -> Frames | Failure | None:
        """The prefix that a program draws.

        Parameters
        ----------
        program
            The program.
        hopeless
            Asked now and then, with the frames so far, whether to give up.

        Returns
        -------
        ndarray, Failure or None
            The prefix as it is evaluated; None if it was given up.
        """
        if program not in self._begun:
            found = self._watched(program, hopeless)
            if found is None:
                return None
            self._begun[program] = found
        return self._begun[program]

    def _watched(
        self, program: Runnable, hopeless: Callable[[Frames], bool] | None
    ) -> Frames | Failure | None:
        given_up, looks = False, [*LOOKS]

        def watch(frames: list[Frames]) -> bool:
            nonlocal given_up
            if hopeless is not None and looks and len(frames) == looks[0]:
                looks.pop(0)
                start = time.monotonic()
                given_up = hopeless(np.stack(frames))
                self.seconds -= time.monotonic() - start
            return not given_up and len(frames) < self._known

        outcome = self._run(program, watch)
        if not given_up:
            return self._reduced(outcome)
        self._drop(program)
        return None

    def whole(self, program: Runnable) -> Frames | Failure:
        """Prefix and continuation that a program draws, as they are evaluated."""
        if program not in self._whole:
            self._whole[program] = self._reduced(self._run(program))
            self._drop(program)
        return self._whole[program]

    def keep(self, programs: Collection[Runnable]) -> None:
        """Drop what waits and is not among these."""
        for program in [p for p in self._waiting if p not in programs]:
            self._drop(program)

    def _drop(self, program: Runnable) -> None:
        self._waiting.pop(program).close()

    def close(self) -> None:
        """Drop all that waits."""
        self.keep(())
        if self._server:
            self._server.close()

    def _reduced(self, outcome: Outcome) -> Frames | Failure:
        if outcome.status != "ok":
            return Failure(outcome.status, outcome.message)
        try:
            return reduce_clip(outcome.frames, FRAMERATE)
        except ValueError as error:
            return Failure("wrong_shape", str(error))

    def _run(
        self,
        program: Runnable,
        watch: Callable[[list[Frames]], bool] | None = None,
    ) -> Outcome:
        if program not in self._waiting:
            self._server = self._server or ForkServer()
            self._waiting[program] = Running(
                program.text,
                timeout=self._limit or LEAST_TIME,
                trusted=program.trusted or not self._sandbox,
                server=self._server,
                keep=self._keep,
            )
        outcome = self._waiting[program].go_on(watch)
        self.seconds += outcome.seconds
        if outcome.status == "timeout" and self._limit is None:
            self._limit = max(LEAST_TIME, TIMES_REFERENCE * self._time_of_reference())
            if self._limit > LEAST_TIME:
                self._drop(program)
                return self._run(program, watch)
        if outcome.status == "killed":
            raise InfrastructureError(f"a program was killed: {outcome.message}")
        return outcome

    def _keep(self, index: int, frame: Frames) -> Frames | None:
        """A frame as it is evaluated; one that is not square is left as it is."""
        if not is_kept(index, self._form.framerate):
            return None
        height, width, _ = frame.shape
        return reduce_clip(frame[None], FRAMERATE)[0] if height == width else frame

    def _time_of_reference(self) -> float:
        start = time.monotonic()
        run(link(Scene.from_yaml(self._reference, "reference")), trusted=True).expect()
        return time.monotonic() - start
