"""The store keeps what it is given and does not trust what it finds."""

import json
import resource
import subprocess
import sys

import numpy as np
import pytest

from mpmworlds.builder.manifest import text_sha256
from mpmworlds.builder.store import Store
from mpmworlds.sim.encode import ColorError, decode_mp4, frames_sha256


@pytest.fixture
def entry(tmp_path, make_program, run_inline):
    """Store with one entry, its program and its frames."""
    store, program = Store(tmp_path / "store"), make_program(3)
    frames = run_inline(program)
    store.put(program, frames, 30)
    return store, program, frames


def file_of(store, suffix):
    (path,) = store.root.rglob(f"*{suffix}")
    return path


def test_a_sample_comes_back_whole(entry):
    store, program, frames = entry
    sample = store.get(text_sha256(program))
    assert sample.program == program
    assert sample.description.frames_sha256 == frames_sha256(frames)
    assert (sample.description.num_frames, sample.description.framerate) == (8, 30)
    assert sample.description.resolution == 64
    np.testing.assert_array_equal(decode_mp4(sample.video), frames)


def test_a_program_that_was_not_rendered_is_missing(entry):
    assert entry[0].get(text_sha256("another program")) is None


def test_putting_twice_changes_no_byte(entry):
    store, program, frames = entry
    before = {p: p.read_bytes() for p in store.root.rglob("*") if p.is_file()}
    store.put(program, frames, 30)
    assert before == {p: p.read_bytes() for p in store.root.rglob("*") if p.is_file()}


@pytest.mark.parametrize("suffix", [".mp4", ".py", ".json"])
@pytest.mark.parametrize(
    "damage", [lambda data: data[: len(data) // 2], lambda data: data[:-1] + b"\xff"]
)
def test_a_corrupt_entry_counts_as_missing_with_a_message(
    entry, caplog, suffix, damage
):
    store, program, _ = entry
    path = file_of(store, suffix)
    path.write_bytes(damage(path.read_bytes()))
    assert store.get(text_sha256(program)) is None
    assert str(path.with_suffix("")) in caplog.text
    assert "will be rendered again" in caplog.text


@pytest.mark.parametrize("suffix", [".mp4", ".py", ".json"])
def test_an_entry_without_one_of_its_files_is_missing(entry, suffix):
    store, program, _ = entry
    file_of(store, suffix).unlink()
    assert store.get(text_sha256(program)) is None


def test_a_description_with_other_keys_counts_as_missing(entry, caplog):
    store, program, _ = entry
    file_of(store, ".json").write_text(json.dumps({"framerate": 30}))
    assert store.get(text_sha256(program)) is None
    assert "must be a JSON object with the keys" in caplog.text


def test_frames_that_the_codec_would_change_are_not_stored(tmp_path):
    store = Store(tmp_path / "store")
    with pytest.raises(ColorError):
        store.put("program", np.full((2, 4, 4, 3), (250, 10, 3), np.uint8), 30)
    with pytest.raises(ValueError, match="6 x 4 px, must be square"):
        store.put("program", np.zeros((2, 4, 6, 3), np.uint8), 30)
    assert not store.root.exists()


def test_a_full_disk_is_a_clear_error_and_leaves_nothing_half_written(tmp_path):
    program = """
import sys, numpy as np, signal
from pathlib import Path
from mpmworlds.builder.disk import DiskFullError
from mpmworlds.builder.store import Store
from mpmworlds.sim.palette import PALETTE, rgb
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
colors = np.array([rgb(c) for c in PALETTE.values()], np.uint8)
noise = np.random.default_rng(0).integers(0, len(colors), (4, 64, 64))
try:
    Store(Path(sys.argv[1])).put("program", colors[noise], 30)
except DiskFullError as error:
    print(error)
"""
    done = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "store")],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (9999, 9999)),
        capture_output=True,
        text=True,
        check=True,
    )
    assert "no room to write it" in done.stdout
    assert "free some space" in done.stdout
    assert [p for p in tmp_path.rglob("*") if p.is_file()] == []
