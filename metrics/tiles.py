"""The tiles into which `wmae` and `anomaly` divide an image."""

import numpy as np
import numpy.typing as npt

from mpmworlds.metrics.constants import CONSTANTS


def tile_starts(length: int) -> npt.NDArray[np.intp]:
    """Return the first row (or column) of each tile along one side.

    Tile i covers ``floor(i * length / 4)`` up to the start of the next one, so tiles
    are equal when 4 divides the side and differ by at most one pixel otherwise.

    Parameters
    ----------
    length : int
        Height or width of the image [pixels].

    Returns
    -------
    int array, shape (4,)
        Ascending, distinct.

    Raises
    ------
    ValueError
        If the side is shorter than the number of tiles.
    """
    count = CONSTANTS.tiles_per_side
    if length < count:
        raise ValueError(
            f"image side = {length} px, must be >= {count} (one pixel per tile); "
            "score larger frames"
        )
    return np.arange(count, dtype=np.intp) * length // count


def tile_of_pixel(height: int, width: int) -> npt.NDArray[np.intp]:
    """Return the tile number of every pixel, counted row by row.

    Parameters
    ----------
    height, width : int
        Extent of the image [pixels].

    Returns
    -------
    int array, shape (height, width)
        Values 0..15.
    """
    rows = np.searchsorted(tile_starts(height), np.arange(height), side="right") - 1
    columns = np.searchsorted(tile_starts(width), np.arange(width), side="right") - 1
    return rows[:, None] * CONSTANTS.tiles_per_side + columns[None, :]


def tile_sizes(height: int, width: int) -> npt.NDArray[np.intp]:
    """Return the number of pixels of every tile.

    Parameters
    ----------
    height, width : int
        Extent of the image [pixels].

    Returns
    -------
    int array, shape (16,)
        All at least 1.
    """
    heights = np.diff(tile_starts(height), append=height)
    widths = np.diff(tile_starts(width), append=width)
    return np.outer(heights, widths).ravel()
