"""A corpus of two small simulated worlds, rendered once in a run of the tests."""

import fcntl
import io
import os
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import yaml

from mpmworlds.cli import main

# Long enough that 2.5 s of prefix leave something to predict; a seed is always in
# train, and the parent falls into test.
PARAMS = {
    "version": "0.1.0",
    "root_seed": 1,
    "profiles": {
        "tiny": {
            "seeds": ["s04"],
            "parents": [{"count": 1, "seeds": 35}],
            "children": 0,
            "root_perturbations": 0,
            "child_perturbations": 0,
            "screen": "none",
            "grid_resolution": 32,
            "resolution": 64,
            "duration_frames": 80,
            "rows_per_shard": 4,
            "split": {
                "salt": "tiny-1",
                "test_fraction": 0.9,
                "modification_fraction": 0.5,
            },
        }
    },
    "evaluation": {"predictor": "copy_last", "split": "train"},
}
IDS = ["p0000", "s04"]


@dataclass(frozen=True)
class Small:
    """Where the parts of the corpus are, and what building it printed. Read-only."""

    root: Path

    @property
    def params(self):
        return self.root / "params.yaml"

    @property
    def store(self):
        return self.root / "store"

    @property
    def manifest(self):
        return self.store / "tiny.parquet"

    @property
    def release(self):
        return self.root / "release" / "mpmworlds"

    @property
    def stdout(self):
        return (self.root / "stdout").read_text()

    @property
    def stderr(self):
        return (self.root / "stderr").read_text()


def build_small(tmp_path_factory):
    """Build the corpus, or find the one that another worker of this run has built."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    small = Small(folder / "small")
    with (folder / "small.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not small.root.exists():
            _build(small)
    return small


def _build(small):
    small.root.mkdir()
    small.params.write_text(yaml.safe_dump(PARAMS))
    stdout, stderr = io.StringIO(), io.StringIO()
    places = ["--store", small.store, "--out", small.release, "--workers", "2"]
    with redirect_stdout(stdout), redirect_stderr(stderr):
        status = main(["build", "--params", str(small.params), *map(str, places)])
    assert status == 0, stderr.getvalue()
    (small.root / "stdout").write_text(stdout.getvalue())
    (small.root / "stderr").write_text(stderr.getvalue())
