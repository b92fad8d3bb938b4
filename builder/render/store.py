"""Rendered samples by content: a cache of the function program -> video.

An entry is four files named by the hash of everything that decides its bytes: the
program (``.py``), the video (``.mp4``), the same reduced (``.clip``, an MP4 file, too)
and their description (``.json``). The description is written last, so an entry without
one does not exist.

Any number of processes may use a store at once. Who is going to render a sample claims
it by holding its ``.lock`` file, so that nobody else renders it, too.
"""

import errno
import hashlib
import json
import logging
import os
import shutil
import tempfile
from dataclasses import asdict, dataclass, fields
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Final

from mpmworlds.builder.plan.manifest import text_sha256
from mpmworlds.files.atomic import PART, write_atomically
from mpmworlds.files.disk import disk_errors_named
from mpmworlds.files.locks import Hold, hold, remove_abandoned
from mpmworlds.metrics.reduction import reduce_clip, reduced_framerate
from mpmworlds.sim.run.encode import CODEC, Frames, encode_mp4, frames_sha256

LOCK: Final = ".lock"
DAMAGED: Final = ".damaged"
DAMAGE: Final = {  # what reading finds where something else has taken a file's place
    errno.EISDIR,
    errno.ELOOP,
    errno.ENOTDIR,
}
CHECK: Final = "sha256_of_the_rest"  # key of a description's checksum
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Description:
    """What is known of a rendered video; the ``.json`` file of an entry.

    Attributes
    ----------
    program_sha256, video_sha256, clip_sha256
        SHA-256 of the program text and of the MP4 files.
    frames_sha256
        Hash of the frames, see ``mpmworlds.sim.run.encode.frames_sha256``.
    num_frames, framerate, resolution
        Number of frames, frames per second, pixels along a side.
    """

    program_sha256: str
    video_sha256: str
    clip_sha256: str
    frames_sha256: str
    num_frames: int
    framerate: int
    resolution: int


@dataclass(frozen=True)
class StoredSample:
    """A program, what it renders, and what is known of both.

    Attributes
    ----------
    program
        Its text.
    video
        MP4 file of the frames.
    clip
        MP4 file of the frames as they are evaluated, see `metrics.reduction`.
    description
        Hashes and sizes.
    """

    program: str
    video: bytes
    clip: bytes
    description: Description


@cache  # looking up a version reads files
def renderer() -> str:
    """Name what decides a video's bits besides its program: codec and compiler."""
    return f"{CODEC}, taichi {version('taichi')}"


def encode_sample(program: str, frames: Frames, framerate: int) -> StoredSample:
    """Encode the frames that a program rendered.

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
    StoredSample
        What a store keeps.

    Raises
    ------
    ValueError
        If the frames are not square or hold a colour that the codec changes.
    DiskFullError
        If there is no room for the temporary file of the encoder.
    """
    count, height, width, _ = frames.shape
    if height != width:
        raise ValueError(f"frames are {width} x {height} px, must be square")
    with disk_errors_named(Path(tempfile.gettempdir())):
        video = encode_mp4(frames, framerate)
        reduced = reduce_clip(frames, framerate)
        clip = encode_mp4(reduced, reduced_framerate(framerate))
    description = Description(
        program_sha256=text_sha256(program),
        video_sha256=hashlib.sha256(video).hexdigest(),
        clip_sha256=hashlib.sha256(clip).hexdigest(),
        frames_sha256=frames_sha256(frames),
        num_frames=count,
        framerate=framerate,
        resolution=height,
    )
    return StoredSample(program, video, clip, description)


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
            clip = base.with_suffix(".clip").read_bytes()
        except FileNotFoundError:
            return None
        except (ValueError, RecursionError) as error:
            _log.warning("%s.json: %s; it will be rendered again", base, error)
            return None
        except OSError as error:
            if error.errno not in DAMAGE:
                raise
            _log.warning("%s; it will be rendered again", error)
            return None
        for suffix, data, expected in (
            (".py", program, program_sha256),
            (".mp4", video, description.video_sha256),
            (".clip", clip, description.clip_sha256),
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
        return StoredSample(program.decode(), video, clip, description)

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
        sample = encode_sample(program, frames, framerate)
        self.add(sample)
        return sample.description

    def add(self, sample: StoredSample) -> None:
        """Keep a sample that is encoded already, in place of a corrupt one if need be.

        Parameters
        ----------
        sample
            What ``encode_sample`` made.

        Raises
        ------
        DiskFullError
            If there is no room. Nothing half-written stays behind.
        """
        base = self._base(sample.description.program_sha256)
        _make_folder(base.parent)
        for suffix, data in (
            (".py", sample.program.encode()),
            (".mp4", sample.video),
            (".clip", sample.clip),
            (".json", _text(sample.description).encode()),
        ):
            path = base.with_suffix(suffix)
            if path.is_dir() and not path.is_symlink():  # else it can be replaced
                _put_aside(path)
            write_atomically(path, data)

    def has(self, program_sha256: str) -> bool:
        """Say whether there is an entry, without looking whether it is whole.

        Parameters
        ----------
        program_sha256
            SHA-256 of the program text.
        """
        return self._base(program_sha256).with_suffix(".json").is_file()

    def claim(self, program_sha256: str) -> Hold | None:
        """Claim the right to render a sample, until the claim is released.

        Parameters
        ----------
        program_sha256
            SHA-256 of the program text.

        Returns
        -------
        Hold or None
            None if somebody alive has claimed it. The claim of a process ends with it.
        """
        base = self._base(program_sha256)
        with disk_errors_named(base):
            _make_folder(base.parent)
            return hold(base.with_name(f".{base.name}{LOCK}"))

    def sweep(self) -> int:
        """Remove the locks and half-written files of processes that were killed.

        Those of the living stay: they hold them.

        Returns
        -------
        int
            How many files were removed.
        """
        folders = [path for path in self.root.glob("??") if path.is_dir()]
        hidden = [path for f in (self.root, *folders) for path in f.glob(".*")]
        left = [path for path in hidden if path.suffix in (PART, LOCK)]
        return sum(remove_abandoned(path) for path in sorted(left))

    def _base(self, program_sha256: str) -> Path:
        key = text_sha256(f"{program_sha256}\n{renderer()}")
        return self.root / key[:2] / key


def _make_folder(folder: Path) -> None:
    """Make a folder of a store, also where a file or a broken link has its name."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    if os.path.lexists(folder) and not folder.is_dir():
        _put_aside(folder)
    folder.mkdir(exist_ok=True)


def _put_aside(path: Path) -> None:
    """Give what has a name of the store another one, in place of what had that."""
    aside = path.with_name(f".{path.name}{DAMAGED}")
    _log.warning("%s: does not belong there; it is now %s", path, aside.name)
    if aside.is_dir() and not aside.is_symlink():
        shutil.rmtree(aside)
    path.replace(aside)


def _text(description: Description) -> str:
    """A description with its own checksum, JSON."""
    record = asdict(description)
    return json.dumps(record | {CHECK: _check_of(record)}, indent=1) + "\n"


def _parse(data: bytes) -> Description:
    record = json.loads(data)
    names = {f.name for f in fields(Description)}
    if not isinstance(record, dict) or set(record) != names | {CHECK}:
        raise ValueError(
            f"must be a JSON object with the keys {sorted(names | {CHECK})}"
        )
    if record.pop(CHECK) != _check_of(record):
        raise ValueError("corrupt: its values have another sha256 than recorded")
    return Description(**record)


def _check_of(record: dict[str, object]) -> str:
    return text_sha256(json.dumps(record, sort_keys=True))
