"""A program agrees with its scene, or every sentence says in what it does not."""

import textwrap

import numpy as np
import pytest

from mpmworlds.builder.llm.agreement import (
    disagreements,
    edge_iou,
    frame_disagreements,
    read_disagreements,
)
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import Outcome, run
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.similarity import layout_image
from tests.sim.scenes import BODY, JET, OBSTACLE, scene_data

SCENE = Scene.from_data(scene_data(BODY, OBSTACLE, JET))
LINKED = link(SCENE)
RED, GREY = (0xF5, 0x2D, 0x2C), (0x96, 0x96, 0x96)


def shows(frame, status="ok"):
    """Return what runs a program to one frame, or to none."""
    frames = np.zeros((0, 0, 0, 3), np.uint8) if frame is None else frame[None]

    def execute(program, max_frames, timeout):
        assert max_frames == 1
        return Outcome(status, frames, 0.1, "" if status == "ok" else "line 1\nlast")

    return execute


def never(program, max_frames, timeout):
    raise AssertionError("it must not run")


@pytest.mark.slow
def test_linked_program_agrees_with_its_scene():
    assert disagreements(SCENE, LINKED) == []


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("def frames", "def pictures", "the program defines no function frames()"),
        ("import sys", "import os, sys", "the program imports os, beyond"),
        ("import sys", "from .a import b", "the program imports .a, beyond"),
        ("import sys", "import sys; sys.modules", "uses modules, beyond"),
        ("import sys", "import sys; __import__('os')", "uses __import__, beyond"),
        ("import sys", "import sys; open('x')", "uses open, beyond"),
        ("import sys", "import sys; ().__class__", "uses __class__, beyond"),
        ("import sys", "import sys; from numpy import load", "uses load, beyond"),
        ("import sys", "import (", "the program is not Python"),
        ("import sys", "\0", "the program is not Python"),
    ],
)
def test_difference_in_the_text_is_told_without_running_it(old, new, sentence):
    assert old in LINKED
    found = disagreements(SCENE, LINKED.replace(old, new, 1), execute=never)
    assert len(found) == 1
    assert sentence in found[0]


def test_program_of_the_linker_is_not_even_run():
    assert disagreements(SCENE, LINKED, execute=never) == []


@pytest.mark.slow
def test_program_of_another_scene_is_told_by_its_first_frame():
    fewer = Scene.from_data(scene_data(BODY, JET))
    assert disagreements(SCENE, link(fewer)) == [
        "the first frame shows nothing in #969696"
    ]


FREE = """\
import numpy as np


def frames():
    yield np.zeros((64, 64, 3), np.uint8)
"""


def test_program_in_another_form_is_judged_by_its_first_frame():
    assert disagreements(SCENE, FREE, execute=shows(layout_image(SCENE, 64))) == []


def test_program_is_run_and_its_first_frame_is_looked_at():
    assert disagreements(SCENE, FREE) == [
        "the first frame shows nothing in #969696",
        "the first frame shows nothing in #F52D2C",
    ]


WRITES = """\
import cv2
import numpy as np


def frames():
    cv2.VideoWriter({path!r}, cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (64, 64))
    yield np.zeros((64, 64, 3), np.uint8)
"""


def test_program_that_reads_harmless_and_writes_a_file_is_confined(tmp_path):
    path = tmp_path / "was here.avi"
    program = WRITES.format(path=str(path))
    assert list(read_disagreements(program)) == []
    run(program, trusted=True).expect()
    assert path.exists()
    path.unlink()
    disagreements(SCENE, program)
    assert not path.exists()


@pytest.mark.parametrize(
    ("body", "sentence"),
    [
        ("yield 1 / 0", "the program ends in exception before its first frame: "),
        ("while True: pass", "the program ends in timeout before its first frame: "),
    ],
)
def test_program_that_gives_no_frame_disagrees(body, sentence):
    program = textwrap.dedent(FREE).partition("    yield")[0] + f"    {body}\n    yield"
    found = disagreements(SCENE, program, timeout=1.0)
    assert len(found) == 1
    assert found[0].startswith(sentence)


def painted(change):
    """The layout of the scene after a change in place."""
    frame = layout_image(SCENE, 64)
    change(frame, (frame == RED).all(axis=2), (frame == GREY).all(axis=2))
    return list(frame_disagreements(SCENE, frame))


def recolour(frame, red, grey):
    frame[red] = (1, 2, 3)


def remove(frame, red, grey):
    frame[red] = 0


def add(frame, red, grey):
    frame[2:6, 2:6] = (9, 9, 9)


def spray(frame, red, grey):
    frame[8:10, 44:46] = (0x2C, 0x90, 0xF5)


def move(frame, red, grey):
    frame[red] = 0
    frame[np.roll(red, 6, axis=1)] = RED


def nudge(frame, red, grey):
    frame[red] = 0
    frame[np.roll(red, 1, axis=1)] = RED


def grow(frame, red, grey):
    for shift in (-3, -2, -1, 1, 2, 3):
        frame[np.roll(red, shift, axis=1)] = RED


def swap(frame, red, grey):
    frame[red], frame[grey] = GREY, RED


def mirror(frame, red, grey):
    frame[:] = frame[::-1].copy()


@pytest.mark.parametrize(
    ("change", "sentences"),
    [
        (recolour, ["1 colours that no object has, such as #010203", "in #F52D2C"]),
        (remove, ["shows nothing in #F52D2C"]),
        (add, ["1 colours that no object has, such as #090909"]),
        (spray, []),
        (nudge, []),
        (move, ["#F52D2C is elsewhere in the first frame"]),
        (grow, ["#F52D2C covers", "#F52D2C is elsewhere"]),
        (swap, ["#969696 is elsewhere", "#F52D2C is elsewhere"]),
        (mirror, ["#969696 is elsewhere", "#F52D2C is elsewhere"]),
    ],
)
def test_difference_of_the_first_frame_is_told(change, sentences):
    found = painted(change)
    for sentence in sentences:
        assert any(sentence in line for line in found), found
    assert bool(found) == bool(sentences)


def test_frame_of_another_size_is_told():
    frame = np.zeros((32, 48, 3), np.uint8)
    assert list(frame_disagreements(SCENE, frame)) == [
        "the first frame is 32 x 48 pixels, must be 64 x 64"
    ]


def test_iou_forgives_one_pixel_along_the_edge_and_no_more():
    one = np.zeros((20, 20), bool)
    one[5:15, 5:15] = True
    assert edge_iou(one, one) == edge_iou(one, np.roll(one, 1, axis=0)) == 1.0
    # Two columns are beyond reach, one of each mask, of twelve that either covers.
    assert edge_iou(one, np.roll(one, 2, axis=1)) == pytest.approx(1 - 2 / 12)
    assert edge_iou(one, np.roll(~one, 0) & False) == 0.0
