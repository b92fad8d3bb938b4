"""Size, speed and exactness of encoder settings on real renders.

Run ``python benchmarks/codec.py SCENE.yaml ...``: each scene is simulated (minutes for
a full one) and encoded with the release settings and with some alternatives.
"""

import sys
import time
from pathlib import Path
from typing import Final
from unittest.mock import patch

import numpy as np

from mpmworlds.sim import encode
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene

RELEASE: Final = encode.X264
SETTINGS: Final = {
    "release": RELEASE,
    "ultrafast": {**RELEASE, "preset": "ultrafast"},
    "medium": {**RELEASE, "preset": "medium", "refs": "3"},
    "veryslow": {**RELEASE, "preset": "veryslow", "refs": "16"},
    "placebo, 1 reference": {**RELEASE, "refs": "1"},
    "placebo, 4 references": {**RELEASE, "refs": "4"},
    "key frame every 250": {**RELEASE, "g": "250"},
}


def main(paths: list[str]) -> None:
    """Print a table row per scene and setting."""
    sys.stdout.write("| scene | settings | KB | encode [s] | decode [s] | exact |\n")
    sys.stdout.write("|---|---|---|---|---|---|\n")
    for path in map(Path, paths):
        scene = Scene.from_yaml(path.read_text(), source=path.name)
        frames = run(link(scene), trusted=True).expect()
        for name, settings in SETTINGS.items():
            with patch.object(encode, "X264", settings):
                start = time.perf_counter()
                data = encode.encode_unchecked(frames, scene.output.framerate)
                encoded = time.perf_counter()
            seen = encode.decode_mp4(data)
            decoded = time.perf_counter()
            exact = np.array_equal(frames, seen)
            size = f"{len(data) / 1e3:.0f}"
            times = f"{encoded - start:.1f} | {decoded - encoded:.1f}"
            sys.stdout.write(f"| {path.stem} | {name} | {size} | {times} | {exact} |\n")


if __name__ == "__main__":
    main(sys.argv[1:])
