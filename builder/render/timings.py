"""What rendering took: a log in the store, from which a run can be estimated.

No artefact depends on it; without it everything works but estimates.
"""

import json
import os
from collections.abc import Collection
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from mpmworlds.files.disk import disk_errors_named

LOG: Final = "log.jsonl"


@dataclass(frozen=True)
class Timing:
    """What the rendering of one sample took.

    Attributes
    ----------
    id, program_sha256
        The sample.
    simulation_seconds, encoding_seconds
        Wall time of the program, and of encoding, decoding and comparing [s].
    bytes
        Size of the video.
    """

    id: str
    program_sha256: str
    simulation_seconds: float
    encoding_seconds: float
    bytes: int


@dataclass(frozen=True)
class Estimate:
    """What rendering will take, to judge from samples that were rendered.

    Attributes
    ----------
    measured
        How many samples it is judged from.
    core_seconds
        Time on one core [s].
    bytes
        Size of the videos.
    """

    measured: int
    core_seconds: float
    bytes: int

    def summary(self, workers: int) -> dict[str, float]:
        """All of it for a program to read, with the time if `workers` share it [s]."""
        return asdict(self) | {"seconds": self.core_seconds / workers}


def append_line(path: Path, line: str) -> None:
    """Append a line to a file that other processes may append to as well.

    Parameters
    ----------
    path
        The file. Made if it is not there.
    line
        Text that ends in a newline.
    """
    with disk_errors_named(path):
        descriptor = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o666)
        try:
            os.write(descriptor, line.encode())  # at once, so that lines do not mix
        finally:
            os.close(descriptor)


def append_timing(root: Path, timing: Timing) -> None:
    """Add to the log of a store.

    Parameters
    ----------
    root
        Folder of the store.
    timing
        What is known now.
    """
    append_line(root / LOG, json.dumps(asdict(timing)) + "\n")


def read_timings(root: Path) -> list[Timing]:
    """Read the log of a store, less the lines that a killed process left unfinished.

    Parameters
    ----------
    root
        Folder of the store.

    Returns
    -------
    list of Timing
        In the order in which samples were rendered.
    """
    try:
        lines = (root / LOG).read_bytes().splitlines()
    except FileNotFoundError:
        return []
    timings = []
    for line in lines:
        try:
            timings.append(Timing(**json.loads(line)))
        except (TypeError, ValueError):
            continue
    return timings


def estimate(count: int, root: Path, programs: Collection[str]) -> Estimate | None:
    """Estimate what rendering takes.

    Parameters
    ----------
    count
        How many samples are to be rendered.
    root
        Folder of the store.
    programs
        SHA-256 of the programs that are like those samples; others in the log, such as
        those of another corpus at another resolution, tell nothing.

    Returns
    -------
    Estimate or None
        None if none of those programs has been rendered into the store.
    """
    measured = [t for t in read_timings(root) if t.program_sha256 in programs]
    if not measured:
        return None
    seconds = sum(t.simulation_seconds + t.encoding_seconds for t in measured)
    size = sum(t.bytes for t in measured)
    return Estimate(
        measured=len(measured),
        core_seconds=count * seconds / len(measured),
        bytes=round(count * size / len(measured)),
    )
