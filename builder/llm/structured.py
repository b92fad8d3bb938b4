"""The schema of scenes for servers that can keep a model to one."""

from functools import cache
from typing import Any, Final

from mpmworlds.sim.scene.scene import json_schema

RULES: Final = frozenset(  # what a grammar can hold; the rest is for readers
    {
        *("$defs", "$ref", "additionalProperties", "anyOf", "const", "enum", "items"),
        *("maxItems", "maximum", "exclusiveMaximum", "minItems", "minimum", "oneOf"),
        *("exclusiveMinimum", "pattern", "prefixItems", "properties", "required"),
        *("maxLength", "minLength", "type"),
    }
)


@cache
def response_format() -> dict[str, Any]:
    """What asks a server to let a model write nothing but JSON of a scene's form.

    Returns
    -------
    dict
        Value of the key ``response_format`` of a chat completion request. It is not
        strict in the sense of OpenAI, which knows no optional keys.
    """
    schema = _rules_of(json_schema())
    return {
        "type": "json_schema",
        "json_schema": {"name": "scene", "schema": schema, "strict": False},
    }


def _rules_of(schema: Any) -> Any:
    if isinstance(schema, list):
        return [_rules_of(part) for part in schema]
    if not isinstance(schema, dict):
        return schema
    rules = {}
    for key, value in schema.items():
        if key in ("properties", "$defs"):
            rules[key] = {name: _rules_of(part) for name, part in value.items()}
        elif key in RULES:
            rules[key] = _rules_of(value)
    return rules
