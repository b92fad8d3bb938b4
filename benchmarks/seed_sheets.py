"""Draw the contact sheets of all seed scenes into one picture.

python benchmarks/seed_sheets.py docs/seeds.png            # quick, 64 cells
python benchmarks/seed_sheets.py seeds.png --cells 128     # as in the release
python benchmarks/seed_sheets.py one.png --only s09 s13 --count 12 --columns 1

It prints, as Markdown, the wall seconds that each takes to simulate and render.
"""

import argparse
import os
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import run
from mpmworlds.sim.run.sheet import contact_sheet
from mpmworlds.sim.scene.scale import rescale

CAPTION = 18  # pixels


def titled(sheet: np.ndarray, name: str) -> np.ndarray:
    """A sheet with a line of text above it."""
    line = np.zeros((CAPTION, sheet.shape[1], 3), np.uint8)
    font = cv2.FONT_HERSHEY_SIMPLEX
    cv2.putText(line, name, (4, CAPTION - 5), font, 0.42, (220, 220, 220), 1)
    return np.vstack([line, sheet])


def main() -> None:
    """Render every seed, a process per core, and arrange their sheets."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("out", type=Path, help="picture to write (.png)")
    parser.add_argument("--only", nargs="*", default=[""], help="ids of seeds")
    parser.add_argument("--cells", type=int, default=64, help="cells per side")
    parser.add_argument("--frames", type=int, default=300, help="frames per video")
    parser.add_argument("--count", type=int, default=6, help="frames per sheet")
    parser.add_argument("--size", type=int, default=120, help="pixels per frame")
    parser.add_argument("--columns", type=int, default=2, help="sheets side by side")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes")
    options = parser.parse_args()

    def sheet(name: str) -> np.ndarray:
        scene = rescale(seeds[name], options.cells, 4 * options.cells, options.frames)
        start = time.perf_counter()
        frames = run(link(scene), timeout=3600.0, trusted=True).expect()
        steps = scene.simulation.substeps_per_frame
        print(f"| {name} | {steps} | {time.perf_counter() - start:.1f} |", flush=True)
        return titled(contact_sheet(frames, options.count, options.size), name)

    chosen = tuple(options.only)
    seeds = {k: scene for k, scene in load_seeds().items() if k.startswith(chosen)}
    print("| seed | substeps a frame | simulate and render [s] |\n|---|---|---|")
    with ThreadPoolExecutor(options.jobs) as pool:
        sheets = list(pool.map(sheet, seeds))
    sheets += [np.zeros_like(sheets[0])] * (-len(sheets) % options.columns)
    rows = len(sheets) // options.columns
    page = np.hstack(
        [np.vstack(sheets[k * rows : (k + 1) * rows]) for k in range(options.columns)]
    )
    options.out.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(options.out), cv2.cvtColor(page, cv2.COLOR_RGB2BGR))


if __name__ == "__main__":
    main()
