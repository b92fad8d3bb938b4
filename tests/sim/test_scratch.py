"""A scratch folder goes with its process, also when that is killed."""

import signal
import subprocess
import sys
import tempfile

import pytest

from mpmworlds.sim.scratch import Scratch

HOLD = """\
import sys, time
from mpmworlds.sim.scratch import Scratch
scratch = Scratch()
(scratch.path / "kept").write_text("x")
print(scratch.path, flush=True)
time.sleep(600)
"""


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_a_scratch_folder_is_there_while_it_is_open(temporary):
    with Scratch() as scratch:
        (scratch.path / "folder").mkdir()
        assert scratch.path.parent == temporary
    assert list(temporary.iterdir()) == []


def test_what_a_killed_process_left_goes_and_what_is_in_use_stays(temporary):
    command = [sys.executable, "-c", HOLD]
    kept = {}
    for _ in range(2):
        process = subprocess.Popen(
            command, stdout=subprocess.PIPE, text=True, env={"TMPDIR": str(temporary)}
        )
        kept[process.stdout.readline().strip()] = process
    (dead, killed), (alive, running) = kept.items()
    killed.send_signal(signal.SIGKILL)
    killed.communicate()
    with Scratch() as scratch:
        found = {str(path) for path in temporary.iterdir()}
        assert found == {alive, str(scratch.path)}
        assert dead not in found
    running.kill()
    running.communicate()


def test_folders_of_others_are_left_alone(temporary):
    other = temporary / "mpmworlds-notes"
    other.mkdir()
    elsewhere = temporary / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / ".held").write_text("")
    (temporary / "mpmworlds-link").symlink_to(elsewhere)
    with Scratch():
        assert other.is_dir()
    assert (elsewhere / ".held").exists()
