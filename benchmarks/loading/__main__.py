"""What it costs to load, to read and to verify a release.

    python -m benchmarks.loading RELEASE [--config mini] [--samples 24]

Each figure is a median; those of two ways are measured in turns, so that their ratio
holds on a machine that others use, too. Loading is measured in processes of their own.
"""

import argparse
import io
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import av
import cv2
import numpy as np

from mpmworlds.builder.release.verify import verify_release
from mpmworlds.loaders.clips import clip_of
from mpmworlds.loaders.mapped import mapped

ROUNDS: Final = 5
OPENED: Final = """
import time, tempfile, os
os.environ["HF_HOME"] = tempfile.mkdtemp()
os.environ["HF_HUB_OFFLINE"] = "1"
import mpmworlds, datasets
from datasets import load_dataset
start = time.perf_counter()
{}
print(time.perf_counter() - start)
"""
WAYS: Final = {
    "load_dataset of {config}, cold": 'load_dataset("{release}", "{config}")',
    "load_dataset of recipes, cold": 'load_dataset("{release}", "recipes")',
    "mpmworlds.load of {config}": 'mpmworlds.load("{release}", config="{config}")',
    "mpmworlds.load of recipes": """
rows = mpmworlds.load("{release}", "train+modification_validation+test", "recipes")
""",
    "recipes opened and filtered": """
rows = mpmworlds.load("{release}", "train+modification_validation+test", "recipes")
found = rows.table.filter(
    lambda named: ["sand" in names for names in named],
    input_columns="materials", batched=True, batch_size=10_000)
assert len(found)
""",
    "one sample by its id": """
mpmworlds.load("{release}", ids=["{id}"])[0]
""",
}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("release", type=Path)
    parser.add_argument("--config", default="mini")
    parser.add_argument("--samples", type=int, default=24)
    options = parser.parse_args()
    rows = mapped(options.release, options.config, "test")
    print("seconds")
    for name, code in WAYS.items():
        told = {"release": options.release, "config": options.config}
        code = code.format(**told, id=rows[0]["id"])
        print(f"  {name.format(**told):36s} {in_processes(code):7.2f}")
    decoding(rows.select(range(min(options.samples, len(rows)))))
    verifying(options.release)


def in_processes(code: str, times: int = 3) -> float:
    """Median of the seconds that something takes in new processes."""
    command = [sys.executable, "-c", OPENED.format(code)]
    found = [
        float(subprocess.run(command, capture_output=True, check=True).stdout)
        for _ in range(times)
    ]
    return statistics.median(found)


def decoding(rows: Any) -> None:
    """Whole clips and videos, by the loader and by bare decoders of the same files."""
    for column in ("clip", "video"):
        seconds: dict[str, list[float]] = {}
        frames = 0
        for index in [*range(len(rows)), *reversed(range(len(rows)))]:
            for name, way in ways_to_read(rows, index, column).items():
                start = time.perf_counter()
                result = way()
                seconds.setdefault(name, []).append(time.perf_counter() - start)
                frames = len(result) if name == "opencv" else frames
        print(f"{column}, in any order: videos/s, frames/s of the file")
        for name, found in seconds.items():
            each = statistics.median(found)
            print(f"  {name:12s} {1 / each:8.1f} {frames / each:9.0f}")
        ratio = statistics.median(
            a / b for a, b in zip(seconds["loader"], seconds["opencv"], strict=True)
        )
        print(f"  loader / opencv, median of the ratios: {ratio:.2f}")


def ways_to_read(rows: Any, index: int, column: str) -> dict[str, Callable[[], Any]]:
    """Decode one row: bare, and with all that the loader does."""
    data = rows[index][column]["bytes"]

    def by_loader() -> Any:
        row = rows[index]
        kept = {k: v for k, v in row.items() if k not in ("clip", "video")}
        return clip_of(kept | {column: row[column]}).frames

    return {
        "opencv": lambda: by_opencv(data),
        "pyav": lambda: by_pyav(data),
        "loader": by_loader,
    }


def by_opencv(data: bytes) -> Any:
    """All frames as RGB."""
    source: Any = io.BytesIO(data)
    video = cv2.VideoCapture(source, cv2.CAP_FFMPEG, [])
    frames = []
    while True:
        there, frame = video.read()
        if not there:
            return np.stack(frames)
        frames.append(cv2.cvtColor(frame, cv2.COLOR_BGR2RGB))


def by_pyav(data: bytes) -> Any:
    """All frames as RGB."""
    with av.open(io.BytesIO(data)) as container:
        frames = [f.to_ndarray(format="rgb24") for f in container.decode(video=0)]
    return np.stack(frames)


def verifying(release: Path) -> None:
    """The whole check without simulation, per megabyte of files of rows.

    In seconds of a core of this one process, which other processes do not lengthen. The
    second check without videos finds the corpus of the package read already, so it
    shows what each further file costs.
    """
    size = sum(f.stat().st_size for f in (release / "data").rglob("*-*.arrow")) / 1e6
    for name, videos in (
        ("without videos", False),
        ("without videos, again", False),
        ("with videos", True),
    ):
        start = time.process_time()
        found = verify_release(release, resimulate=0, workers=1, videos=videos).findings
        seconds = time.process_time() - start
        print(
            f"verify {name}: {size:.0f} MB, {seconds:.1f} s of a core, "
            f"{size / seconds:.1f} MB/s; {len(found)} findings"
        )


if __name__ == "__main__":
    main()
