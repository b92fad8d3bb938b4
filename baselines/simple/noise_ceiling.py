"""The sample's own scene from places that differ by nothing that can be known.

Splashes are chaotic: no predictor can be expected to do better.
"""

from collections.abc import Sequence

from mpmworlds.baselines.protocol import Answers, ProgramText, Task
from mpmworlds.sim.run.displace import displaced


class NoiseCeiling:
    """Answers with the program of the row, its matter displaced by a hair.

    Parameters
    ----------
    seed
        Which displacements.
    """

    name = "noise_ceiling"

    def __init__(self, seed: int = 0) -> None:
        self._seed = seed

    def reveal(self, task: Task, answers: Answers) -> Sequence[ProgramText]:
        """Return the displaced program."""
        return [ProgramText(displaced(str(answers.row["program"]), self._seed))]
