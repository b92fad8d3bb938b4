"""What is asked of models that write programs, and what is read in their replies."""

import numpy as np
import pytest

from mpmworlds.baselines.learned.writing import (
    check_question,
    question,
    read_choice,
    read_reply,
    seed_of,
)
from mpmworlds.baselines.protocol import Failure, ProgramText, SceneText, Task
from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.loaders.regimes import REGIMES

pytest.importorskip("markdown_it", reason="needs mpmworlds[vlm] or [served]")

PROGRAM = '"""A world."""\nimport numpy as np\n\n\ndef frames():\n    yield 0\n'
OTHER = "import numpy as np\n\nprint(np.zeros(3))\n"
COMMAND = "mpmworlds run p.py\n"
SCENE = "schema: mpmworlds-scene/1\nobjects: []\n"


def block(text, language="python"):
    return f"```{language}\n{text}```\n"


@pytest.mark.parametrize(
    "reply",
    [
        block(PROGRAM),
        block(PROGRAM, ""),
        block(PROGRAM, "py"),
        block(PROGRAM).replace("```", "~~~~"),
        f"Let me see.\n\n{block(OTHER)}\nSo:\n{block(PROGRAM)}Done.",
        f"{block(PROGRAM)}\nTry it:\n{block(OTHER)}",
        f"{block(COMMAND, 'bash')}\n{block(PROGRAM)}",
        f"<think>{block(OTHER)}</think>\n{block(PROGRAM)}",
        f"{block(PROGRAM.replace('yield 0', 'yield 1'))}\nBetter:\n{block(PROGRAM)}",
        PROGRAM,
        block(PROGRAM).replace("\n", "\r\n"),
    ],
    ids=[
        *("fenced", "unnamed", "py", "tildes", "after another", "before another"),
        *("beside a command", "after thought", "last of two", "bare", "CR LF"),
    ],
)
def test_the_program_of_a_reply_is_found(reply):
    found = read_reply(reply, "program")
    assert isinstance(found, ProgramText)
    assert found.text.replace("\r\n", "\n") == PROGRAM


@pytest.mark.parametrize(
    ("reply", "outcome"),
    [
        ("The ball falls.", "no_program"),
        ("", "no_program"),
        (block(SCENE, "yaml"), "no_program"),
        ("def frames():\n    yield of frames is what", "no_program"),
        ("I'm sorry, I cannot write this.", "refused"),
        (f"Here:\n```python\n{PROGRAM}", "truncated"),
    ],
)
def test_a_reply_without_a_program_fails_in_its_own_way(reply, outcome):
    found = read_reply(reply, "program")
    assert isinstance(found, Failure)
    assert found.outcome == outcome
    assert found.reason


@pytest.mark.parametrize("reply", [SCENE, block(SCENE, "yaml"), block(SCENE, "")])
def test_the_scene_of_a_reply_is_found(reply):
    assert read_reply(reply, "scene") == SceneText(SCENE)


def test_a_program_is_no_scene():
    found = read_reply(block(PROGRAM), "scene")
    assert isinstance(found, Failure) and found.outcome == "no_scene"


@pytest.mark.parametrize(
    ("choice", "outcome"),
    [
        (
            {"finish_reason": "length", "message": {"content": block(PROGRAM)}},
            "truncated",
        ),
        ({"finish_reason": "content_filter", "message": {"content": ""}}, "refused"),
        ({"finish_reason": "stop", "message": {"refusal": "No."}}, "refused"),
        ({"finish_reason": "stop", "message": {"content": " "}}, "empty"),
        ({"finish_reason": "stop"}, "malformed"),
    ],
)
def test_a_choice_without_an_end_or_a_word_is_a_failure(choice, outcome):
    assert read_choice(choice, "program").outcome == outcome


def task(regime="frames_only", told=""):
    frames = np.zeros((6, 8, 8, 3), np.uint8)
    return Task("0" * 16, frames, told, regime, 2, 2, VideoForm(8, 2, 64))


@pytest.mark.parametrize("regime", REGIMES)
def test_a_question_has_what_the_task_has(regime):
    told = "" if REGIMES[regime].blind else "grid: 7"
    asked = question(task(regime, told), 3, "program", schema=False)
    assert [picture.seconds for picture in asked.pictures] == [0.0, 1.5, 2.5]
    text = " ".join(part for part in asked.user if isinstance(part, str))
    assert "8 frames of 64 x 64 pixels, 2 a second" in text
    assert ("grid: 7" in text) == bool(told)
    blind = question(task(regime, told), 0, "program", schema=False)
    assert not blind.pictures and "You are shown none" in blind.user[0]


@pytest.mark.parametrize(
    ("pictures", "wanted"), [(1, "program"), (8, "poem"), (-1, "scene")]
)
def test_what_cannot_be_asked_is_refused(pictures, wanted):
    with pytest.raises(ValueError, match="must be"):
        check_question(pictures, wanted)


def test_seeds_depend_on_all_of_their_names():
    seeds = {seed_of(s, a, b) for s in (0, 1) for a in "xy" for b in ("0", "1")}
    assert len(seeds) == 8
    assert all(0 <= seed < 2**31 for seed in seeds)
    assert seed_of(0, "x", "1") == seed_of(0, "x", "1")
