"""What to say where something is not there: what is, and how to make the rest."""

from collections.abc import Iterable
from typing import Final

from mpmworlds.builder.release.layout import CLIPS

# Rows of what the package's parameters build: measured costs are for one of them.
ROWS: Final = {
    "tiny": 12,
    "mini": 100,
    "evaluation": 240,
    "10k": 10_000,
    "full": 95_805,
    "preview": 100,
}
_CORE_SECONDS: Final = 18.0  # of a row at 512 px: simulation, video and clip
_MEGABYTES: Final = 0.8  # video and clip
_TINY: Final = (0.02, 0.003)  # core-hours and GB of all of `tiny`
_CLIP_SHARE: Final = 0.26  # of the bytes


def cost_of(config: str) -> str:
    """What it takes to build a configuration, in words; "" for one of others.

    Measured on two cores of a server at 2.5 GHz.
    """
    name = config.removesuffix(CLIPS)
    if name not in ROWS:
        return ""
    hours, gigabytes = _TINY
    if name != "tiny":
        hours = ROWS[name] * _CORE_SECONDS / 3600
        gigabytes = ROWS[name] * _MEGABYTES / 1000
    if name != config:
        gigabytes *= _CLIP_SHARE
    return f"about {hours:.2g} core-hours and {gigabytes:.2g} GB"


def no_such_config(config: str, there: Iterable[str], place: str) -> str:
    """That a release lacks a configuration."""
    start = f"{place}: has no configuration {config!r}; it has {', '.join(there)}"
    cost = cost_of(config)
    if not cost:
        return f"{start}; the package can build {', '.join(ROWS)}"
    local = "release/mpmworlds" if "://" in place else place
    return f"{start}. To make it: {_command(config, local)} ({cost})"


def no_release(reason: str) -> str:
    """That there is no release here, and none on the Hub that can be reached."""
    commands = "\n".join(
        f"  {_command(config, 'release/mpmworlds')}   # {cost_of(config)}"
        for config in ("tiny", "mini", "10k")
    )
    return (
        "mpmworlds: there is no release in ./mpmworlds or ./release/mpmworlds, "
        f"$MPMWORLDS_RELEASE names none, and the Hub cannot be had ({reason}). "
        f"To make one:\n{commands}"
    )


def _command(config: str, place: str) -> str:
    return f"mpmworlds build --config {config} --out {place}"
