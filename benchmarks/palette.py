"""Recompute the palette: the colours nearest to even hues that the codec keeps.

Run ``python benchmarks/palette.py``: it sends all 16.7 million colours through the
release codec (about 15 seconds) and prints the table of `sim/scene/palette.py`.
"""

import io
import sys
from colorsys import hsv_to_rgb
from typing import Final

import av
import numpy as np
import numpy.typing as npt

from mpmworlds.sim.run.encode import decode_mp4, encode_unchecked
from mpmworlds.sim.scene.palette import PALETTE

HUES: Final = 24
ROWS: Final = {"strong": (0.82, 0.96), "deep": (0.85, 0.66)}  # saturation, value
GREYS: Final = (255, 200, 150)


def survivors() -> npt.NDArray[np.int64]:
    """Return all colours, (N, 3), that OpenCV and PyAV both decode unchanged."""
    code = np.arange(1 << 24, dtype=np.uint32)
    colors = np.stack([code >> 16, code >> 8 & 255, code & 255], axis=-1)
    frames = colors.astype(np.uint8).reshape(64, 512, 512, 3)
    data = encode_unchecked(frames, 30)
    with av.open(io.BytesIO(data), "r") as container:
        pictures = container.decode(video=0)
        seen = np.stack([p.to_ndarray(format="rgb24") for p in pictures])
    kept = (decode_mp4(data) == frames).all(-1) & (seen == frames).all(-1)
    exact: npt.NDArray[np.int64] = colors[kept.ravel()].astype(np.int64)
    return exact


def main() -> None:
    """Print each palette name with the colour found for it."""
    exact = survivors()
    targets = [
        [255 * part for part in hsv_to_rgb(hue / HUES, *row)]
        for row in ROWS.values()
        for hue in range(HUES)
    ] + [[float(grey)] * 3 for grey in GREYS]
    sys.stderr.write(f"{len(exact) / (1 << 24):.1%} of all colours survive\n")
    for name, target in zip(PALETTE, targets, strict=True):
        best = exact[((exact - target) ** 2).sum(axis=1).argmin()]
        sys.stdout.write(f'"{name}": "#{best[0]:02X}{best[1]:02X}{best[2]:02X}",\n')


if __name__ == "__main__":
    main()
