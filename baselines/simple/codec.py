"""The truth through the codec of ordinary videos: the floor of every video model."""

import io
from collections.abc import Sequence
from fractions import Fraction

import av
import numpy as np

from mpmworlds.baselines.protocol import Answers, Candidate, Task
from mpmworlds.metrics.reduction import Frames


class Codec:
    """Encodes the continuation as H.264, 4:2:0, and decodes it.

    Parameters
    ----------
    crf
        Constant rate factor of x264: 23 is its default.
    """

    name = "codec"

    def __init__(self, crf: int = 23) -> None:
        self._crf = crf

    def reveal(self, task: Task, answers: Answers) -> Sequence[Candidate]:
        """Return what comes back."""
        return [
            Candidate(through_codec(answers.continuation, task.framerate, self._crf))
        ]


def through_codec(frames: Frames, framerate: int, crf: int) -> Frames:
    """Frames as they come back from H.264, uint8 (T, H, W, 3); one thread."""
    file = io.BytesIO()
    options = {"crf": str(crf), "preset": "medium", "threads": "1"}
    with av.open(file, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=framerate, options=options)
        _, stream.height, stream.width, _ = frames.shape
        stream.pix_fmt = "yuv420p"
        stream.codec_context.time_base = Fraction(1, framerate)
        for frame in frames:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(frame, "rgb24")))
        container.mux(stream.encode(None))
    file.seek(0)
    with av.open(file, "r") as received:
        pictures = received.decode(video=0)
        return np.stack([picture.to_ndarray(format="rgb24") for picture in pictures])
