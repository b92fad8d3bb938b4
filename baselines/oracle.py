"""The sample's own program, run again: what a perfect predictor scores.

Anything but a perfect score means that the program is not deterministic here, or that
the video does not hold what the program draws.
"""

from collections.abc import Sequence

from mpmworlds.baselines.protocol import Answers, Candidate, Failure, Task
from mpmworlds.metrics.reduction import reduce_clip
from mpmworlds.sim.run.run import run


class OracleProgram:
    """Runs the program of the release row."""

    name = "oracle"

    def reveal(self, task: Task, answers: Answers) -> Sequence[Candidate | Failure]:
        """Return the frames of the program, or the status that its run ended with."""
        outcome = run(str(answers.row["program"]))
        if outcome.status != "ok":
            return [Failure(outcome.status, outcome.message)]
        seen = len(task.prefix)
        frames = reduce_clip(outcome.frames, int(answers.row["framerate"]))
        return [Candidate(frames[seen : seen + task.horizon], prefix=frames[:seen])]
