"""From a scene to an encoded sample: what a worker does, on whatever machine."""

import os
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from mpmworlds.builder.plan.manifest import ManifestRow, text_sha256
from mpmworlds.builder.render.executors import Lost
from mpmworlds.builder.render.store import StoredSample, encode_sample, renderer
from mpmworlds.files.disk import disk_errors_named
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene


@dataclass(frozen=True)
class Job:
    """A program to render.

    Attributes
    ----------
    id
        Id of the sample.
    program
        The program text.
    framerate
        Frames per second of the video [1/s].
    """

    id: str
    program: str
    framerate: int

    @property
    def program_sha256(self) -> str:
        """SHA-256 of the program text."""
        return text_sha256(self.program)


@dataclass(frozen=True)
class Rendered:
    """A sample and what it took.

    Attributes
    ----------
    sample
        Program, video, description.
    renderer
        Codec and compiler of the machine that it was rendered on.
    simulation_seconds, encoding_seconds
        Wall time of the program, and of encoding, decoding and comparing [s].
    """

    sample: StoredSample
    renderer: str
    simulation_seconds: float
    encoding_seconds: float


@dataclass(frozen=True)
class Failed:
    """Why a program gave no sample: a status or the name of an error, and more."""

    kind: str
    reason: str


def job_of(row: ManifestRow) -> Job:
    """Link the scene of a manifest row.

    Parameters
    ----------
    row
        The sample.

    Returns
    -------
    Job
        Its program.

    Raises
    ------
    ValueError
        If the linker writes another program than the manifest records.
    """
    scene = Scene.from_yaml(row.scene, source=row.id)
    program = link(scene)
    if text_sha256(program) != row.program_sha256:
        raise ValueError(
            f"{row.id}: the linked program's sha256 is {text_sha256(program)[:12]}..., "
            f"the manifest says {row.program_sha256[:12]}...; the manifest is from "
            "another version of mpmworlds: plan it again or use that version"
        )
    return Job(row.id, program, scene.output.framerate)


def render_row(row: ManifestRow) -> Rendered | Failed | Lost:
    """Link and render a manifest row.

    Parameters
    ----------
    row
        The sample.

    Returns
    -------
    Rendered, Failed or Lost
        See ``render_job``.

    Raises
    ------
    ValueError
        If the row does not link to the program that it records.
    """
    return render_job(job_of(row))


def render_job(job: Job) -> Rendered | Failed | Lost:
    """Render a program.

    Parameters
    ----------
    job
        The program.

    Returns
    -------
    Rendered, Failed or Lost
        The encoded sample, or why there is none: a sample's failure is an answer. Lost
        if the machine is at fault, so that another attempt may end well.

    Raises
    ------
    DiskFullError
        If there is no room for temporary files.
    OSError
        For other trouble of the machine and not of the sample.
    """
    # One process per core: threads of the video decoder would only get in the way.
    os.environ["OPENCV_FFMPEG_THREADS"] = "1"
    try:
        with disk_errors_named(Path(tempfile.gettempdir())):
            outcome = run(job.program, trusted=True)
            if outcome.status == "killed":
                return Lost("its program was killed, perhaps for lack of memory")
            if outcome.status != "ok":
                return Failed(outcome.status, outcome.message)
            start = time.monotonic()
            sample = encode_sample(job.program, outcome.frames, job.framerate)
    except OSError:
        raise
    except MemoryError:
        return Lost("there was too little memory to encode it")
    except Exception as error:  # noqa: BLE001  # one sample must not stop the rest
        return Failed(type(error).__name__, str(error))
    seconds = time.monotonic() - start
    return Rendered(sample, renderer(), outcome.seconds, seconds)
