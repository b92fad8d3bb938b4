"""The store keeps what it is given and does not trust what it finds."""

import errno
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mpmworlds.builder.plan.manifest import text_sha256
from mpmworlds.builder.render.store import Store, encode_sample
from mpmworlds.files.disk import DiskFullError
from mpmworlds.sim.run.encode import ColorError, decode_mp4, frames_sha256


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


@pytest.mark.parametrize("suffix", [".mp4", ".clip", ".py", ".json"])
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


def test_a_description_that_says_something_else_counts_as_missing(entry, caplog):
    store, program, _ = entry
    path = file_of(store, ".json")
    record = json.loads(path.read_text())
    path.write_text(json.dumps(record | {"num_frames": record["num_frames"] + 1}))
    assert store.get(text_sha256(program)) is None
    assert f"{path}: corrupt: its values have another sha256" in caplog.text


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


def loop(path):
    path.symlink_to(path.name)


def folder(path):
    path.mkdir()
    (path / "kept").write_text("something of somebody's")


@pytest.mark.parametrize("suffix", [".mp4", ".py", ".json"])
@pytest.mark.parametrize("damage", [loop, folder])
def test_what_is_no_file_counts_as_missing_and_is_put_in_order(
    damage, suffix, entry, caplog
):
    store, program, frames = entry
    path = file_of(store, suffix)
    path.unlink()
    damage(path)
    assert store.get(text_sha256(program)) is None
    assert "will be rendered again" in caplog.text
    store.sweep()
    with store.claim(text_sha256(program)):
        store.put(program, frames, 30)
    assert store.get(text_sha256(program)).program == program
    if damage is folder:
        (kept,) = store.root.rglob("kept")
        assert kept.parent.name == f".{path.name}.damaged"


@pytest.mark.parametrize("damage", [loop, lambda path: path.write_text("a file")])
def test_what_is_no_folder_for_entries_counts_as_missing_and_is_put_in_order(
    damage, entry, caplog
):
    store, program, frames = entry
    shard = file_of(store, ".mp4").parent
    shutil.rmtree(shard)
    damage(shard)
    assert not store.has(text_sha256(program))
    assert store.get(text_sha256(program)) is None
    store.sweep()
    for _ in range(2):  # a second time there is one that was put aside before
        with store.claim(text_sha256(program)):
            store.put(program, frames, 30)
        assert store.get(text_sha256(program)).program == program
        shutil.rmtree(shard)
        damage(shard)
    assert "does not belong there; it is now" in caplog.text


def test_a_folder_in_place_of_a_description_is_no_entry(entry):
    store, program, _ = entry
    path = file_of(store, ".json")
    path.unlink()
    folder(path)
    assert not store.has(text_sha256(program))


def test_a_description_that_is_nested_too_deeply_counts_as_missing(entry, caplog):
    store, program, _ = entry
    file_of(store, ".json").write_text("[" * 200_000)
    assert store.get(text_sha256(program)) is None
    assert "will be rendered again" in caplog.text


def test_a_file_that_may_not_be_read_is_no_damage(entry, monkeypatch):
    """Trouble of the machine is told, and nothing is rendered again for it."""
    store, program, _ = entry

    def refuse(path):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))

    monkeypatch.setattr(Path, "read_bytes", refuse)
    with pytest.raises(PermissionError):
        store.get(text_sha256(program))


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
from mpmworlds.files.disk import DiskFullError
from mpmworlds.files.disk import DiskFullError
from mpmworlds.builder.render.store import Store, encode_sample
from mpmworlds.sim.scene.palette import PALETTE, rgb
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


# ---- several processes, and the end of them


def end_of(child):
    """Run a function in a forked process; how that ends, as ``waitstatus``."""
    process = os.fork()
    if process == 0:
        try:
            child()
        finally:
            os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def files_of(store):
    return sorted(path for path in store.root.rglob("*") if path.is_file())


@pytest.fixture
def sample(make_program, run_inline):
    program = make_program(2, size=16)
    return encode_sample(program, run_inline(program), 30)


def kill_at(step):
    """Arrange that this process is killed just before a step of writing files."""
    steps = iter(range(step + 1))

    def count(do):
        def counted(*arguments):
            if next(steps) == step:
                os.kill(os.getpid(), signal.SIGKILL)
            return do(*arguments)

        return counted

    os.fsync, Path.replace = count(os.fsync), count(Path.replace)


@pytest.mark.parametrize("step", range(12))  # fsync, replace, fsync of four files
def test_a_writer_killed_at_any_step_leaves_nothing_wrong(step, sample, tmp_path):
    key = sample.description.program_sha256
    store, whole = Store(tmp_path / "store"), Store(tmp_path / "whole")

    def write():
        kill_at(step)
        store.claim(key)
        store.add(sample)

    assert end_of(write) == -signal.SIGKILL
    assert store.get(key) == (sample if step == 11 else None)
    assert store.sweep() == 1 + (step % 3 < 2)  # the claim, and perhaps a part
    store.add(sample)
    whole.add(sample)
    assert store.get(key) == sample
    assert [p.name for p in files_of(store)] == [p.name for p in files_of(whole)]


def test_a_claim_is_given_once_and_leaves_no_file(sample, tmp_path):
    store, key = Store(tmp_path / "store"), sample.description.program_sha256
    claim = store.claim(key)
    assert Store(store.root).claim(key) is None
    assert end_of(lambda: os._exit(store.claim(key) is None)) == 1
    with store.claim("0" * 64):
        assert len(files_of(store)) == 2
    claim.close()
    assert files_of(store) == []
    with store.claim(key) as again:
        assert again is not None


def test_sweeping_spares_the_living(sample, tmp_path):
    store, key = Store(tmp_path / "store"), sample.description.program_sha256
    reader, writer = os.pipe()
    go_on, told = os.pipe()

    def write():
        replace = Path.replace

        def told_replace(*arguments):
            os.write(writer, b"!")
            os.read(go_on, 1)
            return replace(*arguments)

        Path.replace = told_replace
        with store.claim(key):
            store.add(sample)

    process = os.fork()
    if process == 0:
        try:
            write()
        finally:
            os._exit(0)
    for _ in range(4):
        os.read(reader, 1)  # it is about to rename
        assert {p.suffix for p in files_of(store)} >= {".part", ".lock"}
        assert store.sweep() == 0
        os.write(told, b"!")
    os.waitpid(process, 0)
    assert store.get(key) == sample
    assert store.sweep() == 0
    assert len(files_of(store)) == 4


def test_sweeping_leaves_other_files_alone(entry):
    store, _, _ = entry
    before = [*files_of(store), store.root / ".gitignore"]
    (store.root / ".gitignore").write_text("*")
    assert store.sweep() == 0
    assert files_of(store) == sorted(before)


def test_a_sample_for_which_there_is_no_room_is_left_out_whole(sample, tmp_path):
    store = Store(tmp_path / "store")

    def write():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        limit = len(sample.program) + 1  # the program fits, the video does not
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        try:
            store.add(sample)
        except DiskFullError:
            os._exit(7)

    assert end_of(write) == 7
    assert [path.suffix for path in files_of(store)] == [".py"]
    assert store.get(sample.description.program_sha256) is None
