"""The sample's own program, run again: what a perfect predictor scores.

Anything but a perfect score means that the program is not deterministic here, or that
the video does not hold what the program draws.
"""

from collections.abc import Sequence

from mpmworlds.baselines.protocol import Answers, ProgramText, Task


class OracleProgram:
    """Answers with the program of the release row."""

    name = "oracle"

    def reveal(self, task: Task, answers: Answers) -> Sequence[ProgramText]:
        """Return the program."""
        return [ProgramText(str(answers.row["program"]))]
