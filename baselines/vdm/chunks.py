"""A long continuation in pieces that a video model makes in one call each.

The models have four frames to a latent after the first, so all that they are given,
and all that they return, is 4 k + 1 frames long.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from mpmworlds.baselines.vdm.backends.protocol import Backend
from mpmworlds.baselines.vdm.memory import STRIDE
from mpmworlds.metrics.reduction import Frames


class Chunk(NamedTuple):
    """One call of a model."""

    given: int
    """Number of frames that it sees, the last ones there are."""
    new: int
    """Number of frames that it makes."""
    kept: int
    """How many of those are wanted."""


def whole(frames: int) -> int:
    """The longest 4 k + 1 that is not above a number of frames, at least 1."""
    return max(frames - 1, 0) // STRIDE * STRIDE + 1


def check_lengths(chunk: int, overlap: int) -> None:
    """Raise `ValueError` unless a model can make chunks of such lengths."""
    for name, value in (("chunk", chunk), ("overlap", overlap)):
        if value < 1 or value != whole(value):
            raise ValueError(
                f"{name} = {value} frames, must be 4 k + 1, as {whole(value)} is"
            )
    if overlap >= chunk:
        raise ValueError(
            f"overlap = {overlap} frames, must be less than chunk = {chunk}"
        )


def plan_chunks(prefix: int, horizon: int, chunk: int, overlap: int) -> list[Chunk]:
    """Lay out the calls of a continuation.

    Parameters
    ----------
    prefix
        Number of frames that are known.
    horizon
        Number of frames that are wanted.
    chunk
        Most frames of a call, given and new, 4 k + 1.
    overlap
        Most frames that are given, 4 k + 1.

    Returns
    -------
    list of Chunk
        Each as long as it may be, the last one no longer than it must be.
    """
    check_lengths(chunk, overlap)
    if prefix < 1:
        raise ValueError(f"prefix = {prefix} frames, must be at least 1")
    found: list[Chunk] = []
    done = 0
    while done < horizon:
        given = min(whole(prefix + done), overlap)
        left = horizon - done
        new = min(chunk - given, -(-left // STRIDE) * STRIDE)
        kept = min(new, left)
        found.append(Chunk(given, new, kept))
        done += kept
    return found


def continue_clip(
    backend: Backend,
    prefix: Frames,
    text: str,
    horizon: int,
    plan: Sequence[Chunk],
    seed_of: Callable[[int], int],
) -> Frames:
    """Continue a clip, chunk by chunk.

    Parameters
    ----------
    backend
        What makes frames.
    prefix
        uint8 (T, H, W, 3), of a size that the backend takes; it stays as it is.
    text
        What is told.
    horizon
        Number of frames to return.
    plan
        Of `plan_chunks`.
    seed_of
        Seed of a chunk by its number.

    Returns
    -------
    ndarray
        uint8 (horizon, H, W, 3).

    Raises
    ------
    ValueError
        If the backend returns another number or size of frames than it was asked for.
    """
    clip = prefix
    for number, chunk in enumerate(plan):
        given = clip[-chunk.given :]
        made = backend.extend(given, text, chunk.new, seed_of(number))
        expected = (chunk.new, *given.shape[1:])
        if made.shape != expected or made.dtype != np.uint8:
            raise ValueError(
                f"backend {backend.name!r}: returned {made.dtype} {made.shape}, must "
                f"be uint8 {expected}"
            )
        clip = np.concatenate([clip, made[: chunk.kept]])
    return clip[len(prefix) : len(prefix) + horizon]
