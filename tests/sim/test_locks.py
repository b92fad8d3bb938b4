"""A held file is nobody else's, and it goes when its holder goes."""

import os
import signal

import pytest

from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.locks import hold, remove_abandoned


def test_a_file_is_held_by_one_at_a_time(tmp_path):
    path = tmp_path / "lock"
    first = hold(path)
    assert hold(path) is None
    assert not remove_abandoned(path)
    first.close()
    assert not path.exists()
    with hold(path):
        assert path.exists()


def test_the_file_of_a_killed_holder_is_abandoned(tmp_path):
    path = tmp_path / "lock"
    process = os.fork()
    if process == 0:
        hold(path)
        os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(process, 0)
    assert path.exists()
    assert remove_abandoned(path)
    assert not path.exists()
    assert not remove_abandoned(path)


def test_what_was_removed_while_it_was_being_locked_is_not_held(tmp_path, monkeypatch):
    path, opened = tmp_path / "lock", []
    real = os.open

    def open_and_lose(*arguments):
        opened.append(real(*arguments))
        if len(opened) == 1:
            path.unlink()  # as a holder does who releases it just now
        return opened[-1]

    monkeypatch.setattr(os, "open", open_and_lose)
    with hold(path) as held:
        assert os.path.samestat(path.stat(), os.fstat(held.descriptor))
    assert len(opened) == 2


def test_a_file_in_no_folder_cannot_be_held(tmp_path):
    with pytest.raises(FileNotFoundError):
        hold(tmp_path / "absent" / "lock")


@pytest.mark.skipif(os.getuid() == 0, reason="root may open every file")
def test_the_file_of_somebody_else_is_left_alone(tmp_path):
    path = tmp_path / "lock"
    path.touch(0o400)
    assert not remove_abandoned(path)


def test_a_file_on_its_way_is_held_until_it_has_its_name(tmp_path, monkeypatch):
    seen = []

    def fsync(_):
        seen.extend(path for path in tmp_path.iterdir() if path.suffix == ".part")
        assert not any(remove_abandoned(path) for path in seen)

    monkeypatch.setattr(os, "fsync", fsync)
    write_atomically(tmp_path / "x", b"new")
    assert len(seen) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["x"]
    assert (tmp_path / "x").read_bytes() == b"new"
