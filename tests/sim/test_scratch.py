"""A scratch folder goes with its process, also when that is killed."""

import errno
import fcntl
import os
import shutil
import subprocess
import sys
import tempfile

import pytest

from mpmworlds.files.scratch import Scratch

HOLD = """\
import sys, time
from mpmworlds.files.scratch import Scratch
scratch = Scratch()
(scratch.path / "kept").write_text("x")
print(scratch.path, flush=True)
time.sleep(600)
"""


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


@pytest.fixture
def holders(temporary):
    """Return two processes by the names of their scratch folders."""
    processes = {}
    for _ in range(2):
        process = subprocess.Popen(
            [sys.executable, "-c", HOLD],
            stdout=subprocess.PIPE,
            text=True,
            env={"TMPDIR": str(temporary)},
        )
        processes[process.stdout.readline().strip()] = process
    yield processes
    for process in processes.values():
        process.kill()
        process.wait()
        process.stdout.close()


def folders(parent):
    return {str(path) for path in parent.iterdir() if path.is_dir()}


def test_a_scratch_folder_is_there_while_it_is_open(temporary):
    with Scratch() as scratch:
        (scratch.path / "folder").mkdir()
        assert scratch.path.parent == temporary
        assert scratch.path.stat().st_mode & 0o777 == 0o700
    assert list(temporary.iterdir()) == []


def test_a_scratch_folder_that_is_no_longer_used_goes(temporary):
    scratch = Scratch()
    assert folders(temporary) == {str(scratch.path)}
    del scratch
    assert list(temporary.iterdir()) == []


def test_what_a_killed_process_left_goes_and_what_is_in_use_stays(temporary, holders):
    (dead, killed), (alive, _) = holders.items()
    assert folders(temporary) == {dead, alive}
    killed.kill()
    killed.wait()
    with Scratch() as scratch:
        assert folders(temporary) == {alive, str(scratch.path)}
    assert list(temporary.glob("*.held")) == [temporary / f"{alive}.held"]


def test_a_file_without_its_folder_goes_too(temporary):
    (temporary / "mpmworlds-killed.held").write_text("")
    with Scratch():
        assert not (temporary / "mpmworlds-killed.held").exists()


def test_folders_of_others_are_left_alone(temporary):
    other = temporary / "mpmworlds-notes"
    other.mkdir()
    with Scratch():
        assert other.is_dir()


def test_without_locks_there_are_scratch_folders_all_the_same(temporary, monkeypatch):
    def no_locks(*_):
        raise OSError(95, "not supported")

    monkeypatch.setattr(fcntl, "flock", no_locks)
    with Scratch() as first, Scratch() as second:
        assert folders(temporary) == {str(first.path), str(second.path)}
    assert list(temporary.iterdir()) == []


def test_a_folder_in_which_a_dying_process_still_writes_goes_in_the_end(
    temporary, monkeypatch
):
    scratch = Scratch()
    emptied, tries = shutil.rmtree, []

    def one_writes(folder):
        emptied(folder)
        tries.append(folder)
        if len(tries) < 3:
            (folder / "kernels").mkdir(parents=True)
            raise OSError(errno.ENOTEMPTY, os.strerror(errno.ENOTEMPTY), str(folder))

    monkeypatch.setattr(shutil, "rmtree", one_writes)
    scratch.close()
    assert len(tries) == 3
    assert list(temporary.iterdir()) == []


def test_a_folder_that_is_locked_goes_all_the_same(as_a_user, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", as_a_user)
    scratch = Scratch()
    inner = scratch.path / "inner"
    (inner / "innermost").mkdir(parents=True)
    for folder in (inner / "innermost", inner, scratch.path):
        folder.chmod(0)
    scratch.close()
    assert os.listdir(as_a_user) == []
