"""Whatever a program does, its run ends in a typed outcome and leaves nothing."""

import os
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import cv2
import numpy as np
import pytest

from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.encode import decode_mp4, encode_mp4, frames_sha256
from mpmworlds.sim.run.run import RunError, run
from mpmworlds.sim.scene.palette import rgb
from mpmworlds.sim.scene.scene import Scene
from tests.sim.scenes import scene_data

FRAMES = """\
import os, signal, subprocess, sys, time
import numpy as np

def frames():
    for t in range(3):
        yield np.full((4, 6, 3), t, np.uint8)
"""
FAILURES = {
    "syntax": ("def frames(:\n    pass\n", "syntax_error", 0, "line 1"),
    "not text": ("# \ud800\n", "syntax_error", 0, "utf-8"),
    "nul": ("# \0\n", "syntax_error", 0, "null"),
    "import": ("import no_such_module\n", "import_error", 0, "no_such_module"),
    "late import": ("def frames():\n import no.such\n", "import_error", 0, "no"),
    "exception": ("raise ValueError('bad luck')\n", "exception", 0, "bad luck"),
    "late exception": (FRAMES + "    1 / 0\n", "exception", 3, "ZeroDivisionError"),
    "late syntax": ("exec('1 +')\n", "exception", 0, "SyntaxError"),
    "segfault": (FRAMES + "    os.kill(os.getpid(), 11)\n", "crash", 3, "SIGSEGV"),
    "killed": (FRAMES + "    os.kill(os.getpid(), 9)\n", "killed", 3, "SIGKILL"),
    "abort": (FRAMES + "    os.abort()\n", "crash", 3, "SIGABRT"),
    "exit": (FRAMES + "    sys.exit(0)\n", "crash", 3, "exit code 0 after 3 frames"),
    "hard exit": ("import os\nos._exit(7)\n", "crash", 0, "exit code 7"),
    "bomb": ("x = [bytearray(1 << 28) for _ in range(99)]", "out_of_memory", 0, "MiB"),
    "no frames()": ("frames = 3\n", "no_frames", 0, "defines no function frames()"),
    "empty": ("def frames():\n    return []\n", "no_frames", 0, "yields nothing"),
    "not frames": ("def frames():\n    yield 3\n", "bad_frames", 0, "frame 0 is int"),
    "dtype": (
        FRAMES + "    yield np.zeros((4, 6, 3))\n",
        "bad_frames",
        3,
        "frame 3 is ndarray float64 (4, 6, 3), must be uint8 (H, W, 3)",
    ),
    "shape": (
        FRAMES + "    yield np.zeros((4, 5, 3), np.uint8)\n",
        "bad_frames",
        3,
        "frame 3 is (4, 5), must be (4, 6) like frame 0",
    ),
}


@pytest.fixture(autouse=True)
def scratch(tmp_path, monkeypatch):
    """A folder for temporary files, which a test must leave empty."""
    folder = tmp_path / "scratch"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    yield folder
    assert list(folder.iterdir()) == []


def lives(pid):
    """Whether a process still runs a moment from now."""
    time.sleep(0.2)  # a signal takes effect a little after it is sent
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state not in "ZX"


@pytest.mark.parametrize("trusted", [True, False], ids=["trusted", "sandbox"])
@pytest.mark.parametrize(
    ("text", "status", "count", "message"), FAILURES.values(), ids=FAILURES
)
def test_failure_is_typed_and_keeps_the_frames_so_far(
    text, status, count, message, trusted
):
    outcome = run(text, timeout=30, memory=3 << 30, trusted=trusted)
    assert (outcome.status, len(outcome.frames)) == (status, count)
    assert message in outcome.message
    with pytest.raises(RunError, match=status):
        outcome.expect()


def test_frames_come_back_as_they_were():
    outcome = run(FRAMES)
    assert (outcome.status, outcome.message) == ("ok", "")
    assert outcome.frames.shape == (3, 4, 6, 3)
    assert outcome.frames[:, 0, 0, 0].tolist() == [0, 1, 2]
    assert outcome.expect() is outcome.frames


@pytest.mark.parametrize("most", [1, 2])
def test_a_run_can_stop_early(most):
    endless = FRAMES + "    while True: yield np.zeros((4, 6, 3), np.uint8)\n"
    assert len(run(endless, max_frames=most).expect()) == most


def test_what_a_failed_program_printed_is_told():
    outcome = run("print('the answer is', 6 * 7)\nraise SystemExit\n")
    assert "the answer is 42" in outcome.message


def test_a_hanging_program_is_ended_with_all_it_started(tmp_path):
    note = tmp_path / "pids"
    hang = f"""
        child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(99)"])
        open({str(note)!r}, "w").write(f"{{os.getpid()}} {{child.pid}}")
        time.sleep(99)
    """
    start = time.monotonic()
    program = FRAMES + textwrap.indent(textwrap.dedent(hang), "    ")
    outcome = run(program, timeout=3, trusted=True)
    assert (outcome.status, len(outcome.frames)) == ("timeout", 3)
    assert 3 <= time.monotonic() - start < 20
    assert not any(map(lives, note.read_text().split()))


@pytest.mark.parametrize("end", ["", "    os._exit(0)\n"], ids=["report", "exit"])
def test_a_program_that_ends_leaves_no_process_behind(tmp_path, end):
    note = tmp_path / "pid"
    sleep = '[sys.executable, "-c", "import time; time.sleep(60)"]'
    start = (
        f"    child = subprocess.Popen({sleep})\n"
        f"    open({str(note)!r}, 'w').write(str(child.pid))\n"
    )
    run(FRAMES + start + end, timeout=30, trusted=True)
    assert not lives(note.read_text())


def test_a_program_sees_no_settings_of_the_user(monkeypatch):
    monkeypatch.setenv("SECRET", "1")
    monkeypatch.setenv("PYTHONPATH", os.getcwd())
    program = (
        "import os, sys\nimport numpy as np\n"
        "def frames():\n"
        f"    seen = 'SECRET' in os.environ or {os.getcwd()!r} in sys.path\n"
        "    yield np.full((1, 1, 3), seen, np.uint8)\n"
    )
    assert not run(program).expect().any()


@pytest.fixture(scope="module")
def scene():
    return Scene.from_data(scene_data(frames=8))


@pytest.fixture(scope="module")
def frames(scene):
    return run(link(scene), timeout=120).expect()


def test_two_runs_give_the_same_bits(scene, frames):
    assert frames_sha256(run(link(scene)).expect()) == frames_sha256(frames)


def test_frames_are_as_many_and_as_large_as_the_scene_says(scene, frames):
    side = scene.output.resolution
    assert frames.shape == (scene.simulation.duration_frames, side, side, 3)


def test_frames_hold_the_colours_of_the_objects_and_black_only(scene, frames):
    colors = {rgb(thing.visualization.color) for thing in scene.objects}
    seen = {tuple(map(int, c)) for c in np.unique(frames.reshape(-1, 3), axis=0)}
    assert seen == colors | {(0, 0, 0)}


def test_the_video_of_a_release_holds_the_frames_bit_for_bit(scene, frames):
    video = encode_mp4(frames, scene.output.framerate)
    np.testing.assert_array_equal(decode_mp4(video), frames)


def test_a_user_gets_a_playable_preview(scene, frames, tmp_path):
    program, video = tmp_path / "program.py", tmp_path / "out.webm"
    program.write_text(link(scene), "utf-8")
    command = [sys.executable, program.name, video.name]
    subprocess.run(command, cwd=tmp_path, check=True, timeout=120)
    reader = cv2.VideoCapture(str(video))
    shown = []
    while (image := reader.read()[1]) is not None:
        shown.append(image[:, :, ::-1])
    assert np.shape(shown) == frames.shape
    assert abs(np.asarray(shown, int) - frames).mean() < 10


def test_a_program_that_prints_without_end_fills_no_disk():
    endless = "def frames():\n    while True:\n        print('x' * 2**20)\n"
    outcome = run(endless, timeout=60, trusted=True)
    assert outcome.status == "too_much_output"
    assert outcome.message == "it printed 16 MiB"


def test_a_process_that_keeps_the_pipe_open_is_not_waited_for():
    fork = "    if os.fork() == 0:\n        os.setsid()\n        time.sleep(5)\n"
    start = time.monotonic()
    outcome = run(FRAMES + fork + "    os._exit(3)\n", timeout=60, trusted=True)
    assert (outcome.status, len(outcome.frames)) == ("crash", 3)
    assert time.monotonic() - start < 4


@pytest.mark.parametrize("trusted", [True, False], ids=["trusted", "sandbox"])
def test_a_program_ends_when_its_caller_is_killed(trusted, tmp_path):
    script = (
        "import sys\n"
        "from mpmworlds.sim.run.run import run\n"
        "say = lambda frames: print(len(frames), flush=True) or True\n"
        f"run(sys.argv[1], trusted={trusted}, watch=say)\n"
    )
    waits = FRAMES + "    time.sleep(60)\n"
    with subprocess.Popen(
        [sys.executable, "-c", script, waits],
        stdout=subprocess.PIPE,
        env=os.environ | {"TMPDIR": str(tmp_path)},
    ) as caller:
        assert [caller.stdout.readline() for _ in range(3)] == [b"1\n", b"2\n", b"3\n"]
        started = descendants(caller.pid)
        assert started
        caller.kill()
    assert not any(map(lives, started))


def descendants(pid):
    """Numbers of the processes that a process has started, and of theirs."""
    listed = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [*map(int, listed), *(n for child in listed for n in descendants(child))]


def test_a_claim_to_have_ended_well_without_a_frame_is_no_success():
    forged = """
import json, os, struct, sys, time
report = json.dumps({"status": "ok", "message": ""}).encode()
pipe = json.loads(sys.argv[1])["pipe"]
os.write(pipe, struct.pack("<4sIIQ", b"REPT", 0, 0, len(report)) + report)
time.sleep(60)
"""
    outcome = run(forged, timeout=30, trusted=True)
    assert (outcome.status, len(outcome.frames)) == ("no_frames", 0)


@pytest.mark.parametrize(
    "does",
    [
        "shutil.rmtree(here)",
        "shutil.rmtree(here); open(here, 'w').close()",
        "shutil.rmtree(here); os.symlink('/', here)",
        "os.makedirs('a/b'); os.chmod('a', 0); os.chmod('.', 0)",
    ],
    ids=["goes", "becomes a file", "becomes a link", "is locked"],
)
def test_whatever_becomes_of_its_folder_a_program_has_an_outcome(does):
    program = FRAMES + f"    import shutil; here = os.getcwd(); {does}\n"
    outcome = run(program, timeout=30, trusted=True)
    assert (outcome.status, len(outcome.frames)) == ("ok", 3)


def test_a_program_cannot_print_into_the_terminal():
    outcome = run("raise ValueError('\\x1b[2J\\x07')\n", trusted=True)
    assert "ValueError: ?[2J?" in outcome.message


RUN = "from mpmworlds.sim.run.run import run; print(run(sys.argv[1]).status)"
RUN_WARM = """
from mpmworlds.sim.run.warm import WarmStart
with WarmStart() as warm:
    print(warm.run(sys.argv[1], 3, 60.0, pictures=True).status)
"""


@pytest.mark.parametrize(
    ("call", "status"), [(RUN, "ok\n"), (RUN_WARM, "no_states\n")], ids=["run", "warm"]
)
@pytest.mark.parametrize("limit", [1 << 30, 3 << 30], ids=["too low", "low"])
def test_a_low_limit_of_the_shell_is_told_or_kept_to(limit, call, status):
    limited = f"resource.setrlimit(resource.RLIMIT_AS, ({limit}, {limit}))"
    done = subprocess.run(
        [sys.executable, "-c", f"import resource, sys\n{limited}\n{call}", FRAMES],
        capture_output=True,
        text=True,
        check=False,
    )
    if limit < 2 << 30:
        assert "1024 MiB of address space here (ulimit -v), must be at" in done.stderr
    else:
        assert done.stdout == status
