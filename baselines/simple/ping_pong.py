"""The prefix played backwards and forwards: motion of the right kind, in place."""

from collections.abc import Sequence

import numpy as np

from mpmworlds.baselines.protocol import Candidate, Task


class PingPong:
    """Turns round at both ends of the prefix."""

    name = "ping_pong"

    def predict(self, task: Task) -> Sequence[Candidate]:
        """Return prefix frames, from the last but one backwards."""
        last = len(task.prefix) - 1
        way = np.arange(1, task.horizon + 1) % max(2 * last, 1)
        return [Candidate(task.prefix[np.abs(last - way)])]
