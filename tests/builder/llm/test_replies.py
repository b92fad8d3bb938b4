"""A reply gives a valid scene in palette colours, or one typed reason why not."""

import json

import pytest

from mpmworlds.builder.llm.replies import (
    Rejection,
    Suggestion,
    UnclosedError,
    fenced_blocks,
    read_choice,
)
from mpmworlds.sim.scene.palette import is_exact, nearest
from tests.builder.llm.llm_server import choice, tiny_scene

SCENE = tiny_scene()
YAML = SCENE.to_yaml()
JSON = json.dumps(SCENE.to_data(), indent=2)
BLOCK = f"```yaml\n{YAML}```\n"
PROGRAM = "import numpy\n\ndef frames():\n    yield 1\n"


def read(text, finish="stop"):
    return read_choice(choice(text, finish), "reply")


@pytest.mark.parametrize(
    "text",
    [
        BLOCK,
        f"Sure!\n\n{BLOCK}\nEnjoy.",
        BLOCK.replace("yaml", "YML", 1),
        BLOCK.replace("```", "~~~~"),
        BLOCK.replace("```yaml", "```"),
        YAML,
        f"\n{YAML}\n",
        BLOCK.replace("\n", "\r\n"),
        f"<think>Perhaps\n```yaml\na: 1\n```\n</think>{BLOCK}",
        f"{BLOCK}```json\n[1]\n```",
        JSON,
        f"<think>Perhaps {{}}</think>\n{JSON}",
    ],
    ids=[
        *("alone", "between prose", "yml", "tildes", "no language", "bare"),
        *("bare with blanks", "CRLF", "after thoughts", "beside others"),
        *("JSON", "JSON after thoughts"),
    ],
)
def test_the_only_yaml_is_the_scene(text):
    found = read(text)
    assert isinstance(found, Suggestion), found
    assert found.scene == SCENE
    assert found.programs == ()


@pytest.mark.parametrize("language", ["python", "py", ""])
def test_program_is_read_beside_the_scene(language):
    found = read(f"{BLOCK}```{language}\n{PROGRAM}```")
    assert (found.scene, found.programs) == (SCENE, (PROGRAM,))


def test_program_that_holds_the_scene_as_text_is_no_second_scene():
    program = f'{PROGRAM}SCENE = """\n{YAML}"""\n'
    assert read(f"{BLOCK}```python\n{program}```").programs == (program,)


@pytest.mark.parametrize(
    ("text", "finish", "reason", "detail"),
    [
        (BLOCK[: len(BLOCK) // 2], "length", "truncated", "limit of tokens"),
        (BLOCK[: len(BLOCK) // 2], "stop", "truncated", "block 1 does not end"),
        (BLOCK, "content_filter", "refused", "content filter"),
        (
            "I'm sorry, but I can't.\nMore.",
            "stop",
            "refused",
            "I'm sorry, but I can't.",
        ),
        ("", "stop", "empty", "no text"),
        (" \n", "stop", "empty", "no text"),
        (None, "stop", "empty", "no text"),
        ([1], "stop", "empty", "no text"),
        ("A scene with a box.", "stop", "no_yaml", "none of 0 fenced blocks"),
        (f"```python\n{PROGRAM}```", "stop", "no_yaml", "none of 1 fenced"),
        (BLOCK + BLOCK, "stop", "several_yaml", "2 YAML blocks"),
        ("```yaml\na: [1\n```", "stop", "bad_yaml", "not valid YAML"),
        ("```yaml\na: \ud800\n```", "stop", "bad_yaml", "not valid YAML"),
        ("```yaml\n- 1\n```", "stop", "invalid_scene", "must be a mapping"),
        (BLOCK.replace("seed: 3", "seed: -3"), "stop", "invalid_scene", "must be >= 0"),
        (BLOCK.replace("object_1", "object_0"), "stop", "invalid_scene", "unique"),
        (BLOCK.replace("'#F52D2C'", "red"), "stop", "invalid_scene", "'red'"),
        (BLOCK.replace("objects:", "objects: 3\nx:"), "stop", "invalid_scene", "x is"),
    ],
)
def test_reply_without_a_scene_has_a_typed_reason(text, finish, reason, detail):
    found = read(text, finish)
    assert isinstance(found, Rejection)
    assert found.reason == reason
    assert detail in found.detail


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (None, "malformed"),
        ("text", "malformed"),
        ({}, "malformed"),
        ({"message": None}, "malformed"),
        ({"message": {"refusal": "No."}}, "refused"),
        ({"message": {}}, "empty"),
    ],
    ids=str,
)
def test_choice_without_text_has_a_typed_reason(data, reason):
    assert read_choice(data, "reply").reason == reason


def test_colours_move_to_the_nearest_of_the_palette():
    before = "#F22A30"
    assert not is_exact(before)
    found = read(BLOCK.replace("#F52D2C", before))
    assert found.scene.objects[0].visualization.color == nearest(before)


def test_two_colours_that_move_together_are_an_invalid_scene():
    text = BLOCK.replace("#969696", "#F0302C")
    assert read(text).scene.objects[1].visualization.color == "#F52D2C"
    assert read(text.replace("#F0302C", "#F5502C")).reason == "invalid_scene"


def test_fence_ends_only_with_one_as_long():
    text = "````yaml\n```\ninner\n```\n````\nafter"
    assert [(b.language, b.text) for b in fenced_blocks(text)] == [
        ("yaml", "```\ninner\n```\n")
    ]
    with pytest.raises(UnclosedError, match="block 2 does not end"):
        fenced_blocks(f"{text}\n```\nopen")


@pytest.mark.parametrize("odd", ["\u2028", "\x0b", "\x85", "\r", "\x00"])
def test_odd_line_ends_hide_no_block(odd):
    (block,) = fenced_blocks(f"a{odd}b\n\n```yaml\nc: 1\n```\n")
    assert (block.language, block.text) == ("yaml", "c: 1\n")


def test_a_block_in_a_list_or_a_quotation_is_one():
    assert fenced_blocks("- one:\n  ```yaml\n  a: 1\n  ```\n")[0].text == "a: 1\n"
    assert fenced_blocks("> ```yaml\n> a: 1\n> ```\n")[0].text == "a: 1\n"
