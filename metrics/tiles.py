"""The tiles into which `wmae` and `anomaly` divide an image."""

from functools import lru_cache

import numpy as np

from mpmworlds.metrics.clips import Indices


def tile_starts(length: int, count: int) -> Indices:
    """Return the first row (or column) of each tile along one side.

    Tile i covers `floor(i * length / count)` up to the start of the next one, so tiles
    are equal when their number divides the side and differ by at most one pixel
    otherwise.

    Parameters
    ----------
    length : int
        Height or width of the image [pixels].
    count : int
        Tiles along it.

    Returns
    -------
    int array, shape (count,)
        Ascending, distinct.

    Raises
    ------
    ValueError
        If the side is shorter than the number of tiles.
    """
    if length < count:
        raise ValueError(
            f"image side = {length} px, must be >= {count} (one pixel per tile); "
            "score larger frames"
        )
    return np.arange(count, dtype=np.intp) * length // count


@lru_cache(maxsize=4)
def tile_of_pixel(height: int, width: int, count: int) -> Indices:
    """Return the tile number of every pixel, counted row by row: (height, width).

    Raises
    ------
    ValueError
        If a side is shorter than the number of tiles.
    """
    rows, columns = (
        np.searchsorted(tile_starts(side, count), np.arange(side), side="right") - 1
        for side in (height, width)
    )
    tiles = rows[:, None] * count + columns[None, :]
    tiles.flags.writeable = False
    return tiles


def tile_sizes(height: int, width: int, count: int) -> Indices:
    """Return the number of pixels of every tile: (count ** 2,), all at least 1."""
    heights = np.diff(tile_starts(height, count), append=height)
    widths = np.diff(tile_starts(width, count), append=width)
    return np.outer(heights, widths).ravel()
