"""Contact sheets: a video at a glance."""

import cv2
import numpy as np
import numpy.typing as npt

BORDER = 2  # pixels
GREY = 80


def contact_sheet(
    frames: npt.NDArray[np.uint8], count: int = 6, size: int = 256
) -> npt.NDArray[np.uint8]:
    """Frames spread evenly over a clip, side by side.

    Parameters
    ----------
    frames : ndarray of uint8, shape (T, H, W, 3)
        The clip, RGB.
    count : int
        How many frames to show, the first and the last among them.
    size : int
        Pixels per side of each.

    Returns
    -------
    ndarray of uint8, shape (size + 4, count * (size + 4), 3)
        The sheet, RGB.
    """
    chosen = np.linspace(0, len(frames) - 1, count).round().astype(int)
    tiles = [
        cv2.copyMakeBorder(
            cv2.resize(frames[i], (size, size), interpolation=cv2.INTER_AREA),
            *(BORDER,) * 4,
            cv2.BORDER_CONSTANT,
            value=(GREY, GREY, GREY),
        )
        for i in chosen
    ]
    return np.hstack(tiles)
