"""Time of an example beside that of OpenCV for the whole video, in one run.

Run ``python -m benchmarks.loaders [SCENE.yaml ...]``: each scene (by default a few
seeds) is simulated, a quarter of a minute each, and its example is made from the full
video, from the reduced clip, and of the prefix alone. Medians of alternating rounds.
"""

import io
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from statistics import median
from typing import Any, Final

import cv2
import numpy as np

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.loaders.clips import clip_of
from mpmworlds.metrics.reduction import reduce_clip, reduced_framerate
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.encode import decode_mp4, encode_mp4
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene

ROUNDS: Final = 11
SEEDS: Final = ("s02", "s04", "s10", "s12", "s16")


def decode_whole(data: bytes) -> None:
    """Have OpenCV decode every frame, and keep none."""
    source: Any = io.BytesIO(data)
    video = cv2.VideoCapture(source, cv2.CAP_FFMPEG, [])
    while video.read()[0]:
        pass


def medians(ways: Mapping[str, Callable[[], Any]]) -> dict[str, float]:
    """Seconds of each way, medians of rounds in which all take turns."""
    seconds: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(ROUNDS):
        for name, way in ways.items():
            start = time.perf_counter()
            way()
            seconds[name].append(time.perf_counter() - start)
    return {name: median(found) for name, found in seconds.items()}


def measure(scene: Scene) -> tuple[int, dict[str, float]]:
    """Size of the video of a scene [bytes], and seconds of each way to read it."""
    frames = run(link(scene), trusted=True).expect()
    framerate = scene.output.framerate
    small = reduce_clip(frames, framerate)
    full = encode_mp4(frames, framerate)
    clip = encode_mp4(small, reduced_framerate(framerate))
    row = {"id": "scene", "framerate": framerate, "video": {"bytes": full}}
    both = row | {"clip": {"bytes": clip}}
    for read in (clip_of(row), clip_of(both)):
        assert np.array_equal(read.frames, small)
    ways = {
        "opencv": lambda: decode_whole(full),
        "decode, then reduce": lambda: reduce_clip(decode_mp4(full), framerate),
        "video": lambda: clip_of(row),
        "prefix": lambda: clip_of(row, prefix_only=True),
        "clip": lambda: clip_of(both),
    }
    return len(full), medians(ways)


def main(paths: list[str]) -> None:
    """Print a row per scene, and the medians of all."""
    scenes = {Path(p).stem: Scene.from_yaml(Path(p).read_text(), p) for p in paths}
    seeds = {n: s for n, s in load_seeds().items() if n.startswith(SEEDS)}
    rows = {name: measure(scene) for name, scene in (scenes or seeds).items()}
    names = list(next(iter(rows.values()))[1])
    print(f"| scene | KB | {' | '.join(f'{n} [s]' for n in names)} | of OpenCV |")
    print("|---|" + "---:|" * (len(names) + 2))
    ratios = []
    for name, (size, seconds) in rows.items():
        of_opencv = {n: seconds[n] / seconds["opencv"] for n in ("video", "clip")}
        ratios.append(of_opencv)
        told = ", ".join(f"{n} {ratio:.2f}" for n, ratio in of_opencv.items())
        times = " | ".join(f"{seconds[n]:.3f}" for n in names)
        print(f"| {name} | {size / 1e3:.0f} | {times} | {told} |")
    told = ", ".join(f"{n} {median(r[n] for r in ratios):.2f}" for n in ratios[0])
    print(f"\nan example, in the time that OpenCV takes for the whole video: {told}")


if __name__ == "__main__":
    main(sys.argv[1:])
