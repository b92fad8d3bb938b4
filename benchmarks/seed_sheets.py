"""Draw the contact sheets of all seed scenes, one row each, into one picture.

python benchmarks/seed_sheets.py docs/seeds.png            # quick, 64 cells
python benchmarks/seed_sheets.py seeds.png --cells 128     # as in the release
"""

import argparse
import os
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.link import link
from mpmworlds.sim.run import run
from mpmworlds.sim.scale import rescale
from mpmworlds.sim.sheet import contact_sheet


def main() -> None:
    """Render every seed, a process per core, and stack their sheets."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path, help="picture to write (.png)")
    parser.add_argument("--cells", type=int, default=64, help="cells per side")
    parser.add_argument("--frames", type=int, default=300, help="frames per video")
    parser.add_argument("--count", type=int, default=8, help="frames per sheet")
    parser.add_argument("--size", type=int, default=160, help="pixels per frame")
    options = parser.parse_args()

    def sheet(name: str) -> np.ndarray:
        scene = rescale(seeds[name], options.cells, 4 * options.cells, options.frames)
        start = time.perf_counter()
        frames = run(link(scene)).expect()
        print(f"{name}: {time.perf_counter() - start:.0f} s", flush=True)
        return contact_sheet(frames, options.count, options.size)

    seeds = load_seeds()
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        rows = list(pool.map(sheet, seeds))
    options.out.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(options.out), cv2.cvtColor(np.vstack(rows), cv2.COLOR_RGB2BGR))


if __name__ == "__main__":
    main()
