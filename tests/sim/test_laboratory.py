"""Programs that are run one after the other in a process draw what they draw alone."""

import copy
import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.laboratory import Laboratory
from mpmworlds.sim.run.lifted import lifted, room_for
from mpmworlds.sim.run.shelf import BETWEEN
from mpmworlds.sim.run.warm import WarmStart
from mpmworlds.sim.scene.scene import Scene

FRAMES = 8
# Between them: all laws, walls, kinds of motion and of emission.
SEEDS = ["s01", "s05", "s08", "s13", "s17", "s19", "s20", "s24", "s26", "s34"]
FAILURES = {
    "syntax": ("def frames(:\n", "syntax_error"),
    "exception": ("raise ValueError('bad luck')\n", "exception"),
    "segfault": ("import os\nos.kill(os.getpid(), 11)\n", "crash"),
    "no frames()": ("frames = 3\n", "no_frames"),
}


def seed(name):
    """The plain data of a seed, coarse and small."""
    (full,) = [n for n in load_seeds() if n.startswith(name)]
    data = load_seeds()[full].to_data()
    data["output"]["resolution"] = 128
    return data


def text_of(data):
    return lifted(link(Scene.from_data(data))).text


def changed(data):
    """A scene of the same kind whose numbers are others, as many as may be."""
    data = copy.deepcopy(data)
    data["environment"]["gravity"] = [0.4, -8.7]
    data["environment"]["walls"]["friction"] = 0.5
    for thing in data["objects"]:
        thing.get("physics_properties", {"density": 0.0})["density"] *= 1.04
        if "initial_state" in thing:
            thing["initial_state"]["velocity"] = [0.13, -0.21]
        if "emission" in thing:
            thing["emission"]["rate"] *= 0.97
    return data


@pytest.fixture(scope="module")
def laboratory():
    with Laboratory() as one:
        yield one


@pytest.fixture(scope="module")
def warm():
    with WarmStart() as one:
        yield one


def alone(warm, text):
    outcome = warm.run(text, FRAMES, 120.0, pictures=True)
    assert outcome.status == "ok", outcome.message
    return outcome.frames


def assert_alike(laboratory, warm, texts):
    for text in texts:
        outcome = laboratory.run(text, FRAMES, 120.0)
        assert outcome.status == "ok", outcome.message
        np.testing.assert_array_equal(outcome.frames, alone(warm, text), strict=True)


def test_a_program_draws_the_same_after_others_of_its_kind(laboratory, warm):
    first, other = (text_of(data) for data in (seed("s08"), changed(seed("s08"))))
    assert_alike(laboratory, warm, [first, other, first])


@pytest.mark.slow
@pytest.mark.parametrize("name", SEEDS)
def test_programs_of_each_kind_draw_what_they_draw_alone(name, laboratory, warm):
    one = seed(name)
    assert_alike(laboratory, warm, map(text_of, (one, changed(one), one)))


def test_a_constant_that_kernels_refer_to_makes_another_kernel(laboratory, warm):
    one, other = seed("s08"), seed("s08")
    other["output"]["resolution"] = 96
    texts = [text_of(data) for data in (one, other)]
    kernels = [lifted(link(Scene.from_data(d))).kernels for d in (one, other)]
    assert kernels[0] == kernels[1]  # the text is the same: only PIXELS differs
    assert_alike(laboratory, warm, [*texts, texts[0]])


def test_the_second_program_of_a_kind_compiles_nothing(warm):
    first, other = (text_of(data) for data in (seed("s08"), changed(seed("s08"))))
    with Laboratory() as laboratory:
        seconds = []
        for text in 4 * (first, other):
            start = time.monotonic()
            laboratory.run(text, 1, 120.0)
            seconds.append(time.monotonic() - start)
    assert min(seconds[2:]) < 0.7 * seconds[0]


@pytest.mark.parametrize("count", [0, 1, 2, 3, 100, 1000, 5000, 123456])
def test_there_is_room_for_all_particles_and_not_for_many_more(count):
    assert count <= room_for(count) <= max(1.5 * count, 2) + 2


@pytest.mark.parametrize(("text", "status"), FAILURES.values(), ids=FAILURES)
def test_a_failure_is_an_outcome_and_the_next_program_still_runs(
    text, status, laboratory, warm
):
    good = text_of(seed("s08"))
    assert laboratory.run(good, 1, 120.0).status == "ok"
    outcome = laboratory.run(text, 1, 60.0)
    assert (outcome.status, len(outcome.frames)) == (status, 0)
    assert_alike(laboratory, warm, [good])


def test_a_hanging_program_is_ended_and_the_next_one_runs(laboratory, warm):
    start = time.monotonic()
    outcome = laboratory.run("while True: pass\n", 1, 1.0)
    assert outcome.status == "timeout" and time.monotonic() - start < 30.0
    assert_alike(laboratory, warm, [text_of(seed("s08"))])


def test_a_process_that_is_killed_between_programs_is_replaced(laboratory, warm):
    text = text_of(seed("s08"))
    assert_alike(laboratory, warm, [text])
    os.kill(laboratory._process.pid, signal.SIGKILL)
    time.sleep(0.2)
    assert_alike(laboratory, warm, [text])


def test_nothing_lives_after_it_is_closed():
    with Laboratory() as laboratory:
        laboratory.run("frames = 3\n", 1, 60.0)
        laboratory.run(text_of(seed("s08")), 1, 120.0)
        pid = laboratory._process.pid
    time.sleep(0.2)
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="tells no memory")
def test_programs_of_a_kind_leave_nothing_behind():
    text = text_of(seed("s08"))
    sizes = []
    with Laboratory() as laboratory:
        for number in range(1, 4 * BETWEEN + 1):
            assert laboratory.run(text, 1, 120.0).status == "ok"
            if number % BETWEEN == 0:
                pages = Path(f"/proc/{laboratory._process.pid}/statm").read_text()
                sizes.append(int(pages.split()[1]) * os.sysconf("SC_PAGE_SIZE"))
    # What is kept of each program shows between any two looks; what libraries load once
    # between some.
    assert min(np.diff(sizes)) < 8 << 20
