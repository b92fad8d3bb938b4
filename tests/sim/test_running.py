"""A program goes on as far as it is asked to, from a server as on its own."""

import os
import signal
import time

import numpy as np
import pytest

from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.forkserver import ForkServer
from mpmworlds.sim.run.run import run
from mpmworlds.sim.run.running import Running
from mpmworlds.sim.scene.scene import Scene
from tests.sim.scenes import BODY, JET, OBSTACLE, scene_data
from tests.sim.test_run import FAILURES, FRAMES
from tests.sim.test_warm import lives

both = pytest.mark.parametrize("forked", [False, True], ids=["alone", "forked"])
each = pytest.mark.parametrize(
    ("text", "status", "count", "message"), FAILURES.values(), ids=FAILURES
)


@pytest.fixture(scope="module")
def server():
    with ForkServer() as server:
        yield server


def up_to(count):
    return lambda frames: len(frames) < count


def test_frames_of_a_linked_program_are_the_same_from_a_server_and_in_parts(server):
    text = link(Scene.from_data(scene_data(BODY, OBSTACLE, JET)))
    alone = run(text, 4, trusted=True).expect()
    with Running(text, trusted=True, server=server) as running:
        parts = [running.go_on(up_to(count)) for count in (1, 3, 4)]
    assert [(p.status, len(p.frames)) for p in parts] == [("ok", n) for n in (1, 3, 4)]
    np.testing.assert_array_equal(parts[-1].frames, alone)


@both
def test_it_waits_and_the_time_that_it_waits_does_not_count(server, forked):
    text = FRAMES + "    yield np.full((4, 6, 3), 9, np.uint8)\n"
    given = server if forked else None
    with Running(text, timeout=6.0, server=given) as running:
        assert len(running.go_on(up_to(2)).frames) == 2
        time.sleep(6.5)
        outcome = running.go_on()
        assert (outcome.status, len(outcome.frames)) == ("ok", 4)
        assert outcome.seconds < 6.0
        again = running.go_on()
        assert (again.status, len(again.frames)) == ("ok", 4)


@both
def test_one_that_waits_is_confined_and_ends_with_its_block(server, forked):
    big = FRAMES.replace("(4, 6, 3)", "(512, 512, 3)")
    with Running(big, server=server if forked else None) as running:
        outcome = running.go_on(up_to(1))
        assert outcome.sandbox["seccomp"]
        pid = running._process.pid
        assert lives(pid)
    assert not lives(pid)


@each
def test_a_failure_from_a_server_is_that_of_a_fresh_interpreter(
    server, text, status, count, message
):
    with Running(text, timeout=60.0, trusted=True, server=server) as running:
        outcome = running.go_on()
    assert (outcome.status, len(outcome.frames)) == (status, count), outcome.message
    assert message in outcome.message


def test_what_it_prints_is_told_with_its_failure(server):
    text = "import sys\nprint('on its way', file=sys.stderr)\n1 / 0\n"
    with Running(text, server=server) as running:
        outcome = running.go_on()
    assert outcome.status == "exception"
    assert "on its way" in outcome.message


def test_several_wait_at_once_and_see_nothing_of_each_other(server):
    text = (
        "import numpy as np\nnp.marks = getattr(np, 'marks', 0) + 1\n"
        "def frames():\n    while True:\n"
        "        yield np.full((300, 300, 3), np.marks, np.uint8)\n"
    )
    held = [Running(text, server=server) for _ in range(3)]
    seen = [one.go_on(up_to(k)).frames for k in (1, 2) for one in held]
    for one in held:
        one.close()
    assert {int(frames.max()) for frames in seen} == {1}


def test_what_waits_dies_with_its_server_and_says_so():
    text = FRAMES.replace("(4, 6, 3)", "(512, 512, 3)")
    with ForkServer() as server, Running(text, server=server) as running:
        assert running.go_on(up_to(1)).status == "ok"
        os.kill(server.pid, signal.SIGKILL)
        outcome = running.go_on()
    assert outcome.status == "killed"
