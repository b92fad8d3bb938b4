"""The last frame, moved on as its pixels last moved."""

from collections.abc import Sequence

import cv2
import numpy as np

from mpmworlds.baselines.protocol import Candidate, Task


class OpticalFlow:
    """Extrapolates dense optical flow by DIS [Kroeger et al. 2016], at constant speed.

    Pixels are picked, not blended, so that colours stay what they are.
    """

    name = "optical_flow"

    def predict(self, task: Task) -> Sequence[Candidate]:
        """Return the last frame, warped ever further."""
        last = task.prefix[-1]
        before = task.prefix[-2] if len(task.prefix) > 1 else last
        flow = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
        still = np.zeros((*last.shape[:2], 2), np.float32)
        # Where each pixel of the last frame has come from.
        back = flow.calc(_luma(last), _luma(before), still)
        rows, columns = np.indices(last.shape[:2], dtype=np.float32)
        frames = [
            cv2.remap(
                last,
                columns + step * back[..., 0],
                rows + step * back[..., 1],
                cv2.INTER_NEAREST,
                borderMode=cv2.BORDER_CONSTANT,
            )
            for step in range(1, task.horizon + 1)
        ]
        return [Candidate(np.stack(frames))]


def _luma(frame: np.ndarray) -> np.ndarray:
    return cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY)
