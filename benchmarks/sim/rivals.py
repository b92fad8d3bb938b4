"""Who programs are measured against, and by which clock."""

import resource
from pathlib import Path

PLAIN_SEEDS = ("s02", "s07", "s12", "s19", "s25")


def plain(scene: str) -> str:
    """The plain program of a material's block or of a seed; see `plain.py`."""
    text = Path(__file__).with_name("plain.py").read_text("utf-8")
    return text.replace('SCENE = "liquid"', f'SCENE = "{scene}"', 1)


def children() -> float:
    """CPU seconds of all processes that have been started and waited for."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
