"""A command that is asked to end leaves no process and no scratch folder."""

import os
import signal
import subprocess
import sys
import time

import pytest

from tests.sim.sandbox.confined import running_in

WAITS = "import time\ntime.sleep(600)\n"
VERBS = ("run", "materialise", "evaluate")
EVALUATED = ("p0002", "p0002-n00")  # of the release


@pytest.fixture
def run(tmp_path):
    """Arguments that run a program without end."""
    program = tmp_path / "program.py"
    program.write_text(WAITS)
    return ["run", program]


@pytest.fixture
def materialise(small, tmp_path):
    """Arguments that render scenes."""
    places = ["--manifest", small.manifest, "--store", tmp_path / "store"]
    return ["materialise", *places, "--workers", 2]


@pytest.fixture
def evaluate(release, tmp_path):
    """Arguments that evaluate programs without end."""
    folder = tmp_path / "predictions"
    folder.mkdir()
    for name in EVALUATED:
        (folder / f"{name}.py").write_text(WAITS)
    places = ["--release", release, "--out", tmp_path / "results"]
    return ["evaluate", "--predictions", folder, *places, "--workers", 2]


@pytest.fixture
def scratch(tmp_path):
    folder = tmp_path / "scratch"
    folder.mkdir()
    return folder


@pytest.fixture
def begun(scratch):
    """Function: arguments -> the process of a command, of which programs run."""
    processes = []

    def begin(arguments):
        process = subprocess.Popen(
            [sys.executable, "-m", "mpmworlds", *map(str, arguments)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            env=os.environ | {"TMPDIR": str(scratch)},
            text=True,
            start_new_session=True,
            preexec_fn=hears_hangups,
        )
        processes.append(process)
        count = 1 if arguments[0] == "run" else 2
        deadline = time.monotonic() + 120
        while len(long_ones(scratch)) < count and time.monotonic() < deadline:
            assert process.poll() is None, process.stderr.read()
            time.sleep(0.05)
        assert running_in(scratch)
        return process

    yield begin
    for process in processes:
        process.kill()
        process.wait()
        process.stderr.close()


def hears_hangups():
    """What ignores them, such as tests under `nohup`, hands that on."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def long_ones(scratch):
    """Folders of running programs that take long; those of a self-check do not."""
    texts = {}
    for path in scratch.glob("*/program.py"):
        try:
            texts[path] = path.read_text()
        except FileNotFoundError:  # it has ended meanwhile
            continue
    long = [path for path, text in texts.items() if text == WAITS or "taichi" in text]
    return [path for path in long if running_in(path.parent)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("verb", "number", "send"),
    [
        *((verb, signal.SIGTERM, os.kill) for verb in VERBS),
        *((verb, signal.SIGHUP, os.killpg) for verb in VERBS),  # a terminal closes
        ("materialise", signal.SIGTERM, os.killpg),  # as a batch system does
    ],
)
def test_a_command_that_is_asked_to_end_tidies_up(
    verb, number, send, request, begun, scratch
):
    process = begun(request.getfixturevalue(verb))
    send(process.pid, number)
    _, err = process.communicate(timeout=60)
    assert list(scratch.iterdir()) == []
    assert running_in(scratch) == []
    assert process.returncode == 128 + number
    told = f"mpmworlds {verb}: ended by {number.name}; run it again to go on"
    assert err.splitlines()[-1] == told


def test_a_command_that_ignores_hangups_goes_on(scratch, tmp_path):
    path = tmp_path / "program.py"
    path.write_text(
        "import os, signal, time\nimport numpy as np\n"
        "def frames():\n"
        "    os.kill(os.getppid(), signal.SIGHUP)\n    time.sleep(0.5)\n"
        "    yield np.zeros((2, 2, 3), np.uint8)\n"
    )
    done = subprocess.run(
        ["nohup", sys.executable, "-m", "mpmworlds", "run", path]
        + ["--unsafe-no-sandbox"],
        capture_output=True,
        env=os.environ | {"TMPDIR": str(scratch)},
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("ok: 1 frames")
    assert list(scratch.iterdir()) == []
