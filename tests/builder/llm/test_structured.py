"""The schema that a server keeps a model to holds the rules of scenes, and no prose."""

import json

import jsonschema
import pytest

from mpmworlds.builder.llm.structured import RULES, response_format
from mpmworlds.builder.seeds import load_seeds
from tests.builder.llm.llm_server import tiny_scene


@pytest.fixture(scope="module")
def schema():
    return response_format()["json_schema"]["schema"]


def test_every_seed_keeps_to_it(schema):
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    for scene in load_seeds().values():
        validator.validate(scene.to_data())


@pytest.mark.parametrize(
    ("section", "key", "value"),
    [
        ("simulation", "grid_resolution", 8),
        ("simulation", "grid_resolution", "fine"),
        ("simulation", "unknown", 1),
        ("environment", "gravity", [1.0]),
    ],
)
def test_what_breaks_a_rule_does_not(section, key, value, schema):
    data = tiny_scene().to_data()
    data[section][key] = value
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(data, schema)


def test_it_says_nothing_for_readers(schema):
    text = json.dumps(schema)
    assert len(text) < 25_000
    for word in ("title", "description", "kind", "tag", "default"):
        assert f'"{word}":' not in text.replace('"kind": {"', "")
    assert "$ref" in RULES
