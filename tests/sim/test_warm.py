"""A program forked from a warm process does what it does on its own, to the bit."""

import os
import signal
import time
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import run
from mpmworlds.sim.run.warm import WarmStart
from mpmworlds.sim.scene.palette import rgb
from mpmworlds.sim.scene.scene import Scene
from tests.sim.scenes import BODY, FAN, JET, OBSTACLE, RIGID, scene_data

BLOCK = BODY | {
    "name": "block",
    "shape": {"type": "box", "center": [0.5, 0.6], "size": [0.1, 0.1]},
    "physics_properties": RIGID,
    "visualization": {"color": "#5EF52C"},
}
FRAMES = 4
FAILURES = {
    "syntax": ("def frames(:\n", "syntax_error", "line 1"),
    "import": ("import no_such_module\n", "import_error", "no_such_module"),
    "exception": ("raise ValueError('bad luck')\n", "exception", "bad luck"),
    "segfault": ("import os\nos.kill(os.getpid(), 11)\n", "crash", "without a report"),
    "exit": ("import os\nos._exit(0)\n", "crash", "without a report"),
    "bomb": ("x = [bytearray(1 << 28) for _ in range(99)]", "out_of_memory", "MiB"),
    "no frames()": ("frames = 3\n", "no_frames", "defines no function frames()"),
    "no states": ("def frames():\n    yield 3\n", "no_states", "has no DT, SUBSTEPS"),
}


@pytest.fixture(scope="module")
def program():
    return link(Scene.from_data(scene_data(BODY, OBSTACLE, FAN, JET, BLOCK)))


@pytest.fixture(scope="module")
def alone(program):
    """The run of the program on its own."""
    outcome = run(program, FRAMES, timeout=120, states=True)
    assert outcome.status == "ok", outcome.message
    return outcome


@pytest.fixture(scope="module")
def scratch(tmp_path_factory):
    return tmp_path_factory.mktemp("scratch")


@pytest.fixture(scope="module")
def warm(scratch):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tempfile.tempdir", str(scratch))
        start = WarmStart(memory=2 << 30)
    with start as warm:
        yield warm


def lives(pid):
    """Whether a process still runs a moment from now."""
    time.sleep(0.2)  # a signal takes effect a little after it is sent
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state not in "ZX"


def assert_same_states(one, other):
    for field in fields(one):
        np.testing.assert_array_equal(
            getattr(one, field.name),
            getattr(other, field.name),
            field.name,
            strict=True,
        )


def assert_works(warm):
    """Hold it to run a program of a few lines."""
    assert warm.run("frames = 3\n", 1, 60.0, pictures=True).status == "no_frames"


def test_frames_and_states_are_those_of_the_program_on_its_own(warm, program, alone):
    outcome = warm.run(program, FRAMES, 120.0, pictures=True)
    assert (outcome.status, outcome.message) == ("ok", "")
    np.testing.assert_array_equal(outcome.frames, alone.frames)
    assert_same_states(outcome.states, alone.states)


def test_without_pictures_the_states_are_the_same_and_nothing_that_moves_is_drawn(
    warm, program, alone
):
    outcome = warm.run(program, FRAMES, 120.0, pictures=False)
    assert (outcome.status, outcome.message) == ("ok", "")
    assert outcome.frames.shape == alone.frames.shape
    seen = {
        tuple(map(int, c)) for c in np.unique(outcome.frames.reshape(-1, 3), axis=0)
    }
    assert seen <= {(0, 0, 0), rgb(OBSTACLE["visualization"]["color"])}
    assert_same_states(outcome.states, alone.states)


def test_kernels_of_one_program_are_shared_with_the_next_and_change_nothing(
    program, alone, scratch, monkeypatch
):
    monkeypatch.setattr("tempfile.tempdir", str(scratch))
    with WarmStart() as warm:
        kept = [
            (
                warm.run(program, FRAMES, 120.0, pictures=False),
                {p.name for p in warm._kernels.glob("**/*.tic")},
            )
            for _ in range(2)
        ]
    (first, compiled), (second, afterwards) = kept
    assert compiled and afterwards == compiled
    for outcome in (first, second):
        assert_same_states(outcome.states, alone.states)


def test_kernels_are_forgotten_after_some_programs_and_after_one_that_died(
    program, scratch, monkeypatch
):
    monkeypatch.setattr("tempfile.tempdir", str(scratch))
    monkeypatch.setattr("mpmworlds.sim.run.warm.SHARING", 3)
    with WarmStart() as warm:
        kept = []
        for text in (program, "import os\nos._exit(1)\n", program, program, program):
            warm.run(text, 1, 120.0, pictures=False)
            kept.append(warm._kernels.exists())
    assert kept == [True, False, True, True, False]


@pytest.mark.parametrize(("text", "status", "message"), FAILURES.values(), ids=FAILURES)
def test_a_failure_is_an_outcome_and_the_next_program_still_runs(
    warm, text, status, message
):
    outcome = warm.run(text, 1, 60.0, pictures=True)
    assert (outcome.status, len(outcome.frames)) == (status, 0)
    assert message in outcome.message
    assert_works(warm)


def test_a_hanging_program_is_ended_with_all_it_started(warm, tmp_path):
    note = tmp_path / "pids"
    text = f"""
import os, subprocess, sys, time
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(99)"])
open({str(note)!r}, "w").write(f"{{os.getpid()}} {{child.pid}}")
time.sleep(99)
"""
    outcome = warm.run(text, 1, 3.0, pictures=True)
    assert outcome.status == "timeout"
    assert outcome.seconds < 30
    assert not any(lives(int(pid)) for pid in note.read_text().split())
    assert_works(warm)


def test_one_program_cannot_change_what_the_next_one_sees(warm):
    spoil = "import numpy\nnumpy.zeros = None\nimport os\nos.environ['SPOILT'] = '1'\n"
    assert warm.run(spoil, 1, 60.0, pictures=True).status == "no_frames"
    look = "import numpy, os\nassert numpy.zeros\nassert 'SPOILT' not in os.environ\n"
    assert warm.run(look, 1, 60.0, pictures=True).status == "no_frames"


def test_programs_leave_no_file(warm, scratch):
    (home,) = (path for path in scratch.iterdir() if path.is_dir())
    warm.run("open('left', 'w').write('x')\n", 1, 60.0, pictures=True)
    assert [p for p in home.rglob("*") if p.is_file() and p.name == "left"] == []
    assert list(home.glob("tmp*")) == []


def test_closing_ends_the_process_and_removes_its_folder(scratch, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(scratch))
    before = set(scratch.iterdir())
    with WarmStart() as warm:
        assert_works(warm)
        pid = warm._server.pid
        assert lives(pid)
        new = set(scratch.iterdir()) - before
        assert len([path for path in new if path.is_dir()]) == 1
    assert not lives(pid)
    assert set(scratch.iterdir()) == before


def test_a_process_that_was_killed_is_started_again(program, alone):
    with WarmStart() as warm:
        for _ in range(2):
            os.kill(warm._server.pid, signal.SIGKILL)
            outcome = warm.run(program, FRAMES, 120.0, pictures=False)
            assert_same_states(outcome.states, alone.states)


def test_a_process_that_cannot_start_is_an_error_that_says_why(tmp_path, monkeypatch):
    broken = tmp_path / "python"
    broken.write_text("#!/bin/sh\necho no room for Taichi\nexit 1\n")
    broken.chmod(0o755)
    monkeypatch.setattr("mpmworlds.sim.run.forkserver.sys.executable", str(broken))
    with WarmStart() as warm, pytest.raises(RuntimeError) as error:
        assert_works(warm)
    assert "has died twice" in str(error.value)
    assert str(error.value).endswith("It says: no room for Taichi")
