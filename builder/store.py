"""Rendered samples by content: a cache of the function program -> video.

An entry is three files named by the hash of everything that decides its bytes: the
program (``.py``), the video (``.mp4``) and their description (``.json``). The
description is written last, so an entry without one does not exist.
"""

import hashlib
import json
import logging
from dataclasses import asdict, dataclass, fields
from importlib.metadata import version
from pathlib import Path

from mpmworlds.builder.disk import disk_errors_named
from mpmworlds.builder.manifest import text_sha256
from mpmworlds.sim.atomic import write_atomically
from mpmworlds.sim.encode import CODEC, Frames, encode_mp4, frames_sha256

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Description:
    """What is known of a rendered video; the ``.json`` file of an entry.

    Attributes
    ----------
    program_sha256, video_sha256
        SHA-256 of the program text and of the MP4 file.
    frames_sha256
        Hash of the frames, see ``mpmworlds.sim.encode.frames_sha256``.
    num_frames, framerate, resolution
        Number of frames, frames per second, pixels along a side.
    """

    program_sha256: str
    video_sha256: str
    frames_sha256: str
    num_frames: int
    framerate: int
    resolution: int


@dataclass(frozen=True)
class StoredSample:
    """A program, the video that it renders as MP4 bytes, and what is known of both."""

    program: str
    video: bytes
    description: Description


def renderer() -> str:
    """Name what decides a video's bits besides its program: codec and compiler."""
    return f"{CODEC}, taichi {version('taichi')}"


class Store:
    """A folder of rendered samples.

    Parameters
    ----------
    root
        The folder. Made when the first sample is put in.
    """

    def __init__(self, root: Path) -> None:
        self.root = root

    def get(self, program_sha256: str) -> StoredSample | None:
        """Return the sample that a program renders, or None if it is not here.

        An entry that is incomplete or differs from its own hashes counts as missing,
        and a warning says so.

        Parameters
        ----------
        program_sha256
            SHA-256 of the program text.
        """
        base = self._base(program_sha256)
        try:
            description = _parse(base.with_suffix(".json").read_bytes())
            program = base.with_suffix(".py").read_bytes()
            video = base.with_suffix(".mp4").read_bytes()
        except FileNotFoundError:
            return None
        except ValueError as error:
            _log.warning("%s.json: %s; it will be rendered again", base, error)
            return None
        for suffix, data, expected in (
            (".py", program, program_sha256),
            (".mp4", video, description.video_sha256),
        ):
            if hashlib.sha256(data).hexdigest() != expected:
                _log.warning(
                    "%s%s: corrupt (%d bytes with another sha256 than recorded); it "
                    "will be rendered again",
                    base,
                    suffix,
                    len(data),
                )
                return None
        return StoredSample(program.decode(), video, description)

    def put(self, program: str, frames: Frames, framerate: int) -> Description:
        """Encode the frames that a program rendered and keep them.

        Parameters
        ----------
        program
            The program text.
        frames
            uint8 (T, N, N, 3), RGB, in palette colours.
        framerate
            Frames per second [1/s].

        Returns
        -------
        Description
            What was stored.

        Raises
        ------
        ValueError
            If the frames are not square or hold a colour that the codec changes.
        DiskFullError
            If there is no room.
        """
        count, height, width, _ = frames.shape
        if height != width:
            raise ValueError(f"frames are {width} x {height} px, must be square")
        base = self._base(text_sha256(program))
        with disk_errors_named(base):
            video = encode_mp4(frames, framerate)  # passes through a temporary file
            description = Description(
                program_sha256=text_sha256(program),
                video_sha256=hashlib.sha256(video).hexdigest(),
                frames_sha256=frames_sha256(frames),
                num_frames=count,
                framerate=framerate,
                resolution=height,
            )
            record = json.dumps(asdict(description), indent=1, sort_keys=True) + "\n"
            base.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(base.with_suffix(".py"), program.encode())
            write_atomically(base.with_suffix(".mp4"), video)
            write_atomically(base.with_suffix(".json"), record.encode())
        return description

    def _base(self, program_sha256: str) -> Path:
        key = text_sha256(f"{program_sha256}\n{renderer()}")
        return self.root / key[:2] / key


def _parse(data: bytes) -> Description:
    record = json.loads(data)
    names = {f.name for f in fields(Description)}
    if not isinstance(record, dict) or set(record) != names:
        raise ValueError(f"must be a JSON object with the keys {sorted(names)}")
    return Description(**record)
