"""Hold programs against those of an earlier version, sample by sample.

    python -m benchmarks.sim.against [FOLDER] [--frames N] [s00 s07 ...]
    python -m benchmarks.sim.against plain

FOLDER holds programs named by their seeds, such as `s02.py`; five of the version before
are in `benchmarks/sim/before`. `plain` stands for five seeds as a plain program writes
them (`plain.py`). For each the rivals take turns: CPU seconds from the start to the
second frame, and of a whole sample, from the start to the proved MP4. The version
before proved a video by decoding it to RGB and comparing all of it; so do plain ones.
"""

import argparse
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
from benchmarks.sim.rivals import PLAIN_SEEDS, children, plain

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.encode import decode_mp4, encode_mp4, encode_unchecked
from mpmworlds.sim.run.run import run

Frames = npt.NDArray[np.uint8]
BEFORE = Path(__file__).parent / "before"


def proved_before(frames: Frames, framerate: int) -> bytes:
    """An MP4 whose frames have all been decoded and compared."""
    data = encode_unchecked(frames, framerate)
    if (frames != decode_mp4(data)).any(axis=-1).any():
        raise ValueError("a colour has changed")
    return data


def seconds(
    program: str, frames: int, prove: Callable[[Frames, int], bytes]
) -> tuple[float, float]:
    """CPU seconds of a program up to its second frame, and of a whole sample."""

    def spent(count: int) -> tuple[float, Frames]:
        before = children()
        pictures = run(program, count, timeout=3600.0, trusted=True).expect()
        return children() - before, pictures

    start, _ = spent(2)
    whole, pictures = spent(frames)
    begin = time.process_time()
    prove(pictures, 30)
    return start, whole + time.process_time() - begin


def main() -> None:
    """Print a row for each seed, and the medians of the ratios."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path, nargs="?", default=BEFORE)
    parser.add_argument("names", nargs="*", help="beginnings of names of seeds")
    parser.add_argument("--frames", type=int, default=300)
    options = parser.parse_args()
    rivals = {
        path.stem: path.read_text("utf-8") for path in options.folder.glob("*.py")
    }
    if options.folder == Path("plain"):
        rivals = {name: plain(name) for name in PLAIN_SEEDS}
    print("| seed | start before, now [s] | sample before, now [s] | ratios |")
    print("|---|---|---|---|", flush=True)
    starts, samples = [], []
    for name, scene in load_seeds().items():
        text = rivals.get(name[:3])
        if text is None or not name.startswith(tuple(options.names) or ""):
            continue
        old = seconds(text, options.frames, proved_before)
        new = seconds(link(scene), options.frames, encode_mp4)
        starts.append(new[0] / old[0])
        samples.append(new[1] / old[1])
        print(
            f"| {name} | {old[0]:.2f}, {new[0]:.2f} | {old[1]:.1f}, {new[1]:.1f} "
            f"| {starts[-1]:.2f}, {samples[-1]:.2f} |",
            flush=True,
        )
    found = f"{statistics.median(starts):.2f}, {statistics.median(samples):.2f}"
    print(f"| median | | | {found} |")


if __name__ == "__main__":
    main()
