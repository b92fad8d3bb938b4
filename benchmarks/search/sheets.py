"""Contact sheets of given results: truth, search, and where they differ."""

import argparse
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from benchmarks.search.drawn import add_results, pairs

from mpmworlds.files.atomic import write_atomically
from mpmworlds.metrics.reduction import Frames
from mpmworlds.sim.run.sheet import contact_sheet

COLUMNS: Final = 8
SIDE: Final = 160  # pixels of a picture


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add of what, and where to."""
    add_results(parser)
    parser.add_argument("--out", type=Path, required=True, help="folder of pictures")


def carry_out(options: argparse.Namespace) -> None:
    """Write a picture of each sample: a row each, times from left to right."""
    options.out.mkdir(parents=True, exist_ok=True)
    for pair in pairs(options):
        truth = np.concatenate([pair.example.prefix, pair.example.continuation])
        path = options.out / f"{pair.example.id}.png"
        write_atomically(path, sheet(truth, pair.frames()))
        print(path)


def sheet(truth: Frames, found: Frames) -> bytes:
    """PNG of both clips and of the pixels that differ."""
    differ = np.where((truth != found).any(axis=3, keepdims=True), np.uint8(255), 0)
    rows = [truth, found, np.broadcast_to(differ, truth.shape).astype(np.uint8)]
    picture = np.vstack([contact_sheet(row, COLUMNS, SIDE) for row in rows])
    done, png = cv2.imencode(".png", picture[..., ::-1])
    if not done:
        raise RuntimeError("OpenCV writes no PNG here; reinstall it")
    return png.tobytes()
