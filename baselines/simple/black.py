"""Nothing but background: the floor that every metric must punish."""

from collections.abc import Sequence

import numpy as np

from mpmworlds.baselines.protocol import Candidate, Task


class Black:
    """Predicts empty frames."""

    name = "black"

    def predict(self, task: Task) -> Sequence[Candidate]:
        """Return ``horizon`` black frames."""
        return [
            Candidate(
                np.zeros_like(task.prefix, shape=(task.horizon, *task.prefix.shape[1:]))
            )
        ]
