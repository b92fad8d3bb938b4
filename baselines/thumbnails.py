"""Small pictures of the prefixes of a split, to find the one most alike."""

import hashlib
import io
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

import cv2
import numpy as np
import numpy.typing as npt
from tqdm import tqdm  # type: ignore[import-untyped]

from mpmworlds.baselines.provenance import release_sha256
from mpmworlds.files.atomic import write_atomically
from mpmworlds.loaders.load import load
from mpmworlds.metrics.reduction import Frames

TIMES: Final = 4  # frames of a prefix, first and last among them
SIDE: Final = 16  # pixels
VERSION: Final = "thumbnails-1"
Pictures = npt.NDArray[np.uint8]


def thumbnail(prefix: Frames) -> Pictures:
    """A prefix in few pixels: uint8 (TIMES * SIDE * SIDE * 3,)."""
    times = np.linspace(0, len(prefix) - 1, TIMES).round().astype(int)
    size = (SIDE, SIDE)
    return np.concatenate(
        [
            cv2.resize(prefix[t], size, interpolation=cv2.INTER_AREA).ravel()
            for t in times
        ]
    )


@dataclass(frozen=True, eq=False)
class Thumbnails:
    """Those of all samples of a split.

    Attributes
    ----------
    pictures
        uint8 (N, P), in the order of the split.
    """

    pictures: Pictures

    @classmethod
    def of(cls, release: Path, config: str, split: str) -> Self:
        """Make them, or read them from the cache if they have been made."""
        where = [VERSION, release_sha256(release, config), config, split]
        name = hashlib.sha256("\0".join(where).encode()).hexdigest()
        home = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
        path = Path(home).expanduser() / "mpmworlds" / f"thumbnails-{name[:16]}.npy"
        if path.is_file():
            return cls(np.load(path))
        examples = load(release, split, config)
        found = [
            thumbnail(example.prefix)
            for example in tqdm(examples, desc=f"{config}/{split}", unit="sample")
        ]
        if not found:
            raise ValueError(f"{release}: {config}/{split} has no sample to retrieve")
        pictures = np.stack(found)
        path.parent.mkdir(parents=True, exist_ok=True)
        buffer = io.BytesIO()
        np.save(buffer, pictures)
        write_atomically(path, buffer.getvalue())
        return cls(pictures)

    @property
    def sha256(self) -> str:
        """Digest of what can be retrieved."""
        return hashlib.sha256(self.pictures.tobytes()).hexdigest()

    def nearest(self, picture: Pictures) -> int:
        """Number of the first sample that differs least, summed over pixels."""
        gaps = np.abs(self.pictures.astype(np.int16) - picture.astype(np.int16))
        return int(gaps.sum(axis=1, dtype=np.int64).argmin())
