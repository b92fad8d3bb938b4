"""No program gets out of the sandbox, whoever runs it, whatever the machine lacks."""

import json
import os
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from tests.sim.sandbox import attacks
from tests.sim.sandbox.bombs import BOMBS, HEAD

HERE = Path(__file__).parent
NO_NAMESPACES = ["unshare"]
NO_LANDLOCK = ["landlock_create_ruleset"]
CONFIGURATIONS = {
    "superuser": {},
    "superuser, no namespaces": {"deny": NO_NAMESPACES},
    "superuser, no Landlock": {"deny": NO_LANDLOCK},
    "user": {"user": 54321},
    "user, no namespaces": {"user": 54321, "deny": NO_NAMESPACES},
    "superuser, forked": {"forked": True},
    "user, no namespaces, forked": {
        "user": 54321,
        "deny": NO_NAMESPACES,
        "forked": True,
    },
}
pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="the sandbox is Linux's"),
    pytest.mark.skipif(os.getuid() != 0, reason="only the superuser can be others"),
]
ATTACKS = HERE.joinpath("attacks.py").read_text("utf-8")
BENIGN = """\
import cv2
import numpy as np
import taichi as ti

ti.init(arch=ti.gpu, cpu_max_num_threads=8, offline_cache=True)
x = ti.field(float, 9)

@ti.kernel
def fill():
    for i in x:
        x[i] = 2.0 * i

def frames():
    for t in range(3):
        fill()
        image = np.full((8, 8, 3), int(x[4]) + t, np.uint8)
        cv2.circle(image, (4, 4), 2, (255, 255, 255), -1)
        print(t)
        yield image
"""
# Attacks that get through without a sandbox everywhere, and prove that they bite.
BITES = {
    *("connects_by_tcp", "sends_udp", "connects_to_a_unix_socket"),
    *("connects_to_an_abstract_socket", "makes_a_pair_of_sockets"),
    *("makes_a_raw_socket_by_number", "reads_a_secret", "reads_the_password_file"),
    *("reads_scenes_of_the_package", "reads_the_environment_of_its_parent"),
    *("lists_the_home_of_the_user", "writes_outside", "writes_beside_itself"),
    *(
        "makes_a_folder",
        "makes_a_file_without_a_name",
        "makes_a_pipe_in_the_file_system",
    ),
    *("links_to_a_secret", "links_hard_to_a_secret", "changes_the_mode_of_a_file"),
    *("changes_the_owner_of_a_file", "changes_the_times_of_a_file", "renames_a_file"),
    *("removes_a_file", "truncates_a_file", "keeps_memory_in_a_file", "shares_memory"),
    *("forks", "spawns", "starts_a_shell", "starts_a_session"),
    *("sends_a_signal_to_its_parent", "sends_a_signal_to_everyone"),
    *("reads_memory_by_number", "holds_a_process", "raises_its_limits"),
    *("lowers_a_limit", "chooses_its_processors", "can_be_traced"),
    *("outlives_its_parent", "sets_the_clock_of_a_signal", "calls_from_made_code"),
    "makes_its_folder_unreadable",
}


def run_as(configuration, programs):
    """Outcomes of programs."""
    done = subprocess.run(
        [sys.executable, str(HERE / "confined.py"), json.dumps(configuration)],
        input=json.dumps(programs),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def got_through(outcome):
    """Names of the attacks that got through."""
    assert outcome["status"] == "ok", outcome
    rows = [row[0][0] for row in outcome["frames"][0]]
    names = [attack.__name__ for attack in attacks.ATTACKS]
    return {name for name, row in zip(names, rows, strict=True) if row}


@cache
def outcomes(name):
    """Of a benign program and of the attacks, in a configuration."""
    return run_as(CONFIGURATIONS[name], [{"text": BENIGN}, {"text": ATTACKS}])


each_configuration = pytest.mark.parametrize("name", CONFIGURATIONS)


@pytest.mark.slow
@each_configuration
def test_a_benign_program_runs_as_ever(name):
    benign, _ = outcomes(name)
    assert (benign["status"], benign["message"]) == ("ok", "")
    images = [frame[0][0][0] for frame in benign["frames"]]
    assert images == [8, 9, 10]
    assert benign["seal"]["seccomp"]
    assert bool(benign["seal"]["landlock"]) == ("Landlock" not in name)
    assert bool(benign["seal"]["namespaces"]) == ("namespaces" not in name)
    assert benign["seal"]["user"] != 0
    assert benign["left"] == []


@pytest.mark.slow
@each_configuration
def test_no_attack_gets_through(name):
    _, attacked = outcomes(name)
    assert got_through(attacked) == set()


@pytest.mark.slow
def test_attacks_get_through_without_a_sandbox():
    (attacked,) = run_as({}, [{"text": ATTACKS, "trusted": True}])
    assert BITES - got_through(attacked) == set()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("denied", "message"),
    [
        ([*NO_LANDLOCK, *NO_NAMESPACES], "cannot confine .* --unsafe-no-sandbox"),
        (["seccomp"], "could not be set up"),
    ],
    ids=["files", "calls"],
)
def test_where_a_layer_is_missing_nothing_runs(denied, message):
    (refused,) = run_as({"deny": denied}, [{"text": BENIGN}])
    assert refused["status"] == "SandboxError"
    assert re.search(message, refused["message"], re.DOTALL)


KERNEL = """
import taichi as ti

@ti.kernel
def endless():
    x = 0
    while x < 1:
        x *= 2
"""


def program(name):
    """Text of a bomb; its kernel is real source, as Taichi wants it."""
    head = (KERNEL if "kernel" in name else "") + HEAD
    if "large frames" in name:
        head = head.replace("(4, 4, 3)", "(4096, 4096, 3)")
    return {"text": head + BOMBS[name].body, "timeout": BOMBS[name].seconds}


@cache
def ends(name):
    """Outcomes of all bombs in a configuration."""
    found = run_as(CONFIGURATIONS[name], [program(bomb) for bomb in BOMBS])
    return dict(zip(BOMBS, found, strict=True))


@pytest.mark.slow
@pytest.mark.parametrize(
    "configuration", ["superuser", "user, no namespaces", "superuser, forked"]
)
@pytest.mark.parametrize("bomb", BOMBS)
def test_a_bomb_ends_in_time_in_a_typed_outcome_and_leaves_nothing(bomb, configuration):
    outcome = ends(configuration)[bomb]
    assert outcome["status"] in BOMBS[bomb].statuses, outcome["message"]
    assert outcome["seconds"] < BOMBS[bomb].seconds + 3
    assert outcome["left"] == []
    assert "\x1b" not in outcome["message"]
    assert len(outcome["message"]) < 12_000


@pytest.mark.slow
def test_without_a_sandbox_something_is_left():
    fork = "    if os.fork() == 0:\n        os.setsid()\n        time.sleep(20)\n"
    fork += "    time.sleep(2)\n"  # else it may be killed before it has left
    (free,) = run_as({}, [{"text": HEAD + fork, "trusted": True}])
    assert len(free["left"]) == 1


@pytest.mark.slow
@pytest.mark.parametrize("configuration", ["superuser", "user, no namespaces"])
def test_a_program_has_few_threads(configuration):
    counted = ends(configuration)["threads"]["frames"][-1][0][0][0]
    assert 10 < counted < 100
