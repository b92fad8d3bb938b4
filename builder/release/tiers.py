"""How equal a video that is simulated again is: bit by bit, by the metrics, or not.

Bits are promised on x86-64 with the same version of Taichi. Elsewhere sums round
otherwise, and what moves chaotically ends elsewhere; a continuation may differ then as
much as two runs do that start from places a millionth apart.
"""

import platform
from collections.abc import Mapping
from functools import cache
from typing import Any, Final, Literal, NamedTuple

from mpmworlds.builder.plan.evaluation import recorded_measured
from mpmworlds.builder.release.checks.videos import decoded_clip
from mpmworlds.builder.render.store import renderer
from mpmworlds.metrics import SCORED, Metric, score
from mpmworlds.metrics.reduction import (
    Frames,
    prefix_length,
    reduce_clip,
    reduced_framerate,
)
from mpmworlds.sim.run.encode import frames_sha256

BITS_ARE_PROMISED: Final = ("x86_64", "amd64")
LEAST_EQUAL: Final = 0.1  # share of the samples whose own ceiling is below the bound
_SLACK: Final = 1e-6  # of a ceiling, which is rounded


class Tier(NamedTuple):
    """How equal two videos are."""

    name: Literal["exact", "tolerance", "neither"]
    text: str
    """In words."""


def bits_are_promised(made_by: str) -> bool:
    """Whether what made a release must give the same bits on this machine."""
    machine = platform.machine().lower()
    return machine in BITS_ARE_PROMISED and made_by == renderer()


def tier_of(frames: Frames, row: Mapping[str, Any]) -> Tier:
    """Compare frames with those of a row of a release.

    Parameters
    ----------
    frames
        uint8 (T, N, N, 3), RGB: what the program of the row gives here.
    row
        With the columns `frames_sha256`, `framerate`, `ceiling` and `clip`.

    Raises
    ------
    ValueError
        If the clip of the row cannot be decoded.
    """
    if frames_sha256(frames) == row["frames_sha256"]:
        return Tier("exact", f"exact: all {len(frames)} frames are equal, bit for bit")
    framerate = int(row["framerate"])
    reference, found = decoded_clip(row), reduce_clip(frames, framerate)
    if reference.shape != found.shape:
        return Tier(
            "neither",
            f"neither equal nor alike: {found.shape} (T, N, N, 3) as it is evaluated, "
            f"must be {reference.shape}",
        )
    length = prefix_length(reduced_framerate(framerate))
    if length < len(found):  # else it is shorter than a prefix: all of it counts
        found, reference = found[length:], reference[length:]
    scores = score(found, reference)
    ceiling = row.get("ceiling")
    bounds = _usual_bounds() if ceiling is None else ceiling
    source = "its noise ceiling" if ceiling else "the noise ceiling of most samples"
    beyond = [name for name in _compared() if _is_beyond(name, scores, bounds)]
    if not beyond:
        told = ", ".join(f"{name} {scores[name]:.4f}" for name in _compared())
        return Tier(
            "tolerance",
            "within metric tolerance, not bit for bit: the continuation is no further "
            f"from the release than {source} ({told})",
        )
    name = beyond[0]
    return Tier(
        "neither",
        f"neither equal nor within metric tolerance: {name} is {scores[name]:.4f}, "
        f"{source} {bounds[name]:.4f}",
    )


def _compared() -> list[str]:
    """Metrics of the paper that compare a clip with another one."""
    return [
        name
        for name, metric in SCORED.items()
        if metric.needs_reference and metric.paper_name
    ]


def _is_beyond(
    name: str, scores: Mapping[str, float], bounds: Mapping[str, float]
) -> bool:
    if bounds.get(name) is None:
        return False
    return (
        _loss(SCORED[name], scores[name]) > _loss(SCORED[name], bounds[name]) + _SLACK
    )


def _loss(metric: Metric, value: float) -> float:
    return abs(value - metric.best)


@cache
def _usual_bounds() -> Mapping[str, float]:
    """What nine tenths of the samples to evaluate on keep to, displaced."""
    ceilings = [
        m.ceiling for m in recorded_measured("full") if m.ceiling and not m.fault
    ]
    bounds = {}
    for name in _compared():
        losses = sorted(
            (c[name] for c in ceilings), key=lambda v: _loss(SCORED[name], v)
        )
        bounds[name] = losses[int((1 - LEAST_EQUAL) * (len(losses) - 1))]
    return bounds
