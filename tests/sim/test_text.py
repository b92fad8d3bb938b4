"""YAML is read strictly, with the place of every fault, and written one way."""

import math
import time

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.sim.scene.errors import SceneError
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.sim.scene.text import LONGEST, dump_yaml, parse_yaml
from tests.sim.scenes import BODY, scene_data


def value_of(text):
    return parse_yaml(f"value: {text}", "scene.yaml")["value"]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-4", 1e-4),
        ("1E5", 1e5),
        ("-1.5e+3", -1500.0),
        (".5", 0.5),
        ("5.", 5.0),
        ("-.inf", -math.inf),
        ("7", 7),
        ("+7", 7),
        ("010", 10),
        ("08", 8),
    ],
)
def test_numbers_are_those_of_yaml_1_2(text, value):
    assert value_of(text) == value
    assert type(value_of(text)) is type(value)


@pytest.mark.parametrize("text", ["1_000", "1:30", "0x10", "1e", "2001-13-45", "e5"])
def test_other_spellings_are_text(text):
    assert value_of(text) == text


@given(
    st.one_of(
        st.floats(allow_nan=False, allow_subnormal=False),  # taichi flushes them to 0
        st.integers(-(2**70), 2**70),
    )
)
def test_every_number_survives_writing_and_reading(number):
    data = {"objects": [], "environment": {"x": number}}
    read = parse_yaml(dump_yaml(data), "scene.yaml")["environment"]["x"]
    assert read == number
    assert type(read) is type(number)


@pytest.mark.parametrize(
    ("text", "place", "problem"),
    [
        ("a: [1", "line 1, column 6", "expected ',' or ']'"),
        ("a: 1\n\tb: 2", "line 2, column 1", "found character '\\t'"),
        ("a: 1\nb: {c: 1, c: 2}", "line 2, column 11", "key 'c' appears twice"),
        ("1: 2", "line 1, column 1", "key 1 is not text"),
        ("{? [1]: 2}", "line 1, column 4", "is not text"),
        ("a: 1\n---\nb: 2", "line 2, column 1", "another document"),
        ("a: !!int x", "line 1, column 4", "'x' is not of type int"),
        ("a: !!bool x", "line 1, column 4", "'x' is not of type bool"),
        ("a: !!timestamp x", "line 1, column 4", "timestamp"),
        ("a: !!python/name:os.system", "line 1, column 4", "os.system"),
        ("a: !!float ''", "line 1, column 4", "'' is not of type float"),
        ("a: &x [1]\nb: *x", "line 2, column 4", "*x stands for something else"),
        ("a: " + 5000 * "9", "line 1, column 4", "is not of type int"),
    ],
)
def test_what_is_no_yaml_is_refused_with_line_and_column(text, place, problem):
    with pytest.raises(SceneError) as error:
        parse_yaml(text, "scene.yaml")
    assert str(error.value).startswith(f"scene.yaml: {place}: not valid YAML: ")
    assert problem in str(error.value)


@pytest.mark.parametrize("text", [600 * "[", "a: \ud800", "\0"])
def test_what_has_no_place_is_refused_all_the_same(text):
    with pytest.raises(SceneError, match=r"^scene\.yaml: not valid YAML"):
        parse_yaml(text, "scene.yaml")


@given(st.text(max_size=40))
def test_any_text_is_data_or_a_scene_error(text):
    try:
        parse_yaml(text, "scene.yaml")
    except SceneError as error:
        assert str(error).startswith("scene.yaml: ")  # noqa: PT017 - either may happen


def test_canonical_text_is_the_same_data_for_any_yaml_reader():
    data = scene_data()
    assert yaml.safe_load(dump_yaml(data)) == data


def test_canonical_text_gives_each_part_of_an_object_a_line():
    data = scene_data()
    lines = dump_yaml(data).splitlines()
    for thing in data["objects"]:
        assert f"- name: {thing['name']}" in lines
        for part in ("shape", "visualization"):
            assert any(line.startswith(f"  {part}: {{") for line in lines)


def test_canonical_text_writes_nothing_by_reference():
    center = [0.5, 0.5]
    data = {"objects": [{"a": center, "b": center}], "environment": {}}
    assert "&" not in dump_yaml(data)


def test_a_long_row_of_digits_is_read_in_no_time():
    start = time.process_time()
    with pytest.raises(SceneError):
        Scene.from_yaml(f"schema: {'1' * 20_000}x")
    assert time.process_time() - start < 1.0


@pytest.mark.parametrize(
    ("text", "told"),
    [(None, "is NoneType, must be text"), (" " * (1 << 19), "must have <= 262144")],
    ids=["none", "long"],
)
def test_what_is_no_scene_file_is_told(text, told):
    with pytest.raises(SceneError, match=told):
        Scene.from_yaml(text)


def test_a_message_shows_few_faults_and_each_on_a_short_line():
    error = SceneError("scene", [f"{i} {'x' * 9000}\ny" for i in range(999)])
    lines = str(error).splitlines()
    assert len(lines) == 21
    assert lines[-1] == "scene: and 979 more"
    assert max(map(len, lines)) < 600
    assert len(error.faults) == 999


def holding(*objects):
    """Data of a scene of objects that may be wrong."""
    return scene_data() | {"objects": list(objects)}


def crowd(count):
    return holding(*(BODY | {"name": f"thing_{i}"} for i in range(count)))


def test_too_many_objects_are_told_in_no_time_and_in_one_line():
    data = crowd(100_000)  # takes time of its own
    start = time.process_time()
    with pytest.raises(SceneError) as error:
        Scene.from_data(data)
    told = "scene: has 100000 objects, must have <= 64; leave some out"
    assert str(error.value) == told
    assert time.process_time() - start < 1.0


def test_objects_that_all_overlap_are_told_in_a_short_time_and_text():
    start = time.process_time()
    with pytest.raises(SceneError) as error:
        Scene.from_yaml(dump_yaml(crowd(64)))
    assert len(error.value.faults) == 64 * 63 // 2
    assert len(str(error.value)) < 5000
    assert time.process_time() - start < 5.0


def test_the_most_objects_of_the_longest_shape_have_room():
    vertices = [[0.1234567890123456] * 2] * 24
    polygon = BODY | {"shape": {"type": "polygon", "vertices": vertices}}
    text = dump_yaml(holding(*[polygon] * 64))
    assert 2 * len(text) < LONGEST


RUDE = "\x1b[2J\r\u202e" + "n" * 9000


@pytest.mark.parametrize(
    "text",
    [
        yaml.safe_dump(holding(BODY | {"name": RUDE})),
        yaml.safe_dump(holding(BODY | {RUDE: 1})),
        yaml.safe_dump(scene_data(BODY) | {RUDE: 1}),
        yaml.safe_dump(scene_data(BODY) | {"schema": RUDE}),
        '"\\e[2J": 1\n"\\e[2J": 1\n',
    ],
    ids=["name", "key of an object", "key", "value", "repeated key"],
)
def test_names_keys_and_values_are_cut_and_cannot_move_the_cursor(text):
    with pytest.raises(SceneError) as error:
        Scene.from_yaml(text, "a\x1b[2Jb.yaml")
    lines = str(error.value).split("\n")
    assert all(line.isprintable() for line in lines)
    assert max(map(len, lines)) < 300
    assert lines[0].startswith("a\\x1b[2Jb.yaml: ")
    assert "\\x1b[2J" in lines[0].removeprefix("a\\x1b[2Jb.yaml: ")


def test_a_long_name_does_not_hide_what_is_wrong():
    with pytest.raises(SceneError, match=r"name = 'nnn.*\.\.\., must match"):
        Scene.from_data(holding(BODY | {"name": "n" * 9000}))
