"""Whether torchcodec, with which ``datasets.Video()`` decodes, gives exact frames here.

It is asked in a process of its own: loading it may end a process, and takes seconds.
"""

import hashlib
import subprocess
import sys
from importlib.util import find_spec
from typing import Final

from mpmworlds.sim.run.encode import decode_mp4

SECONDS: Final = 120
_DECODE: Final = """
import hashlib, sys
from torchcodec.decoders import VideoDecoder
frames = VideoDecoder(sys.stdin.buffer.read(), dimension_order="NHWC")[:]
print(hashlib.sha256(frames.contiguous().numpy().tobytes()).hexdigest())
"""


def judge_torchcodec(video: bytes) -> tuple[bool, str]:
    """Say whether torchcodec decodes a video to the frames that it holds.

    Parameters
    ----------
    video
        A lossless MP4 file of this package.

    Returns
    -------
    tuple
        Whether it does, and what was found, in words.
    """
    if find_spec("torchcodec") is None:
        return False, "not there"
    try:
        done = subprocess.run(
            [sys.executable, "-c", _DECODE],
            input=video,
            capture_output=True,
            timeout=SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return False, f"no answer within {SECONDS} s"
    if done.returncode:
        lines = done.stderr.decode(errors="replace").strip().splitlines()
        return False, f"cannot be loaded: {(lines or ['no reason given'])[-1][:120]}"
    frames = decode_mp4(video)
    if done.stdout.decode().split() != [hashlib.sha256(frames.tobytes()).hexdigest()]:
        return False, "gives WRONG COLOURS"
    return True, "exact"
