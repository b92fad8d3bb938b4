"""The last frame of the prefix, standing still: the floor for settled scenes."""

from collections.abc import Sequence

import numpy as np

from mpmworlds.baselines.protocol import Candidate, Task


class CopyLast:
    """Repeats the last frame seen."""

    name = "copy_last"

    def predict(self, task: Task) -> Sequence[Candidate]:
        """Return the last prefix frame, ``horizon`` times."""
        return [Candidate(np.repeat(task.prefix[-1:], task.horizon, axis=0))]
