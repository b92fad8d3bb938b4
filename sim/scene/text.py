"""YAML in and out: numbers as in YAML 1.2, no duplicate keys, one canonical layout."""

import re
from typing import Any

import yaml

from mpmworlds.sim.scene.errors import SceneError

FLOAT = re.compile(r"^[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?$|^[-+]?\.inf$|^\.nan$")
WIDTH = 110
LONGEST = 1 << 18  # characters of a scene; 64 polygons of 24 vertices take half of it
SafeDumper: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)  # the same, but faster


class _Loader(yaml.SafeLoader):
    """Safe loader that reads 1e-4 as a number; without aliases and repeated keys."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.AliasEvent):  # a few of them may stand for gigabytes
            event = self.peek_event()  # type: ignore[no-untyped-call]
            raise yaml.composer.ComposerError(
                None,
                None,
                f"*{event.anchor} stands for something else; write it out",
                event.start_mark,
            )
        return super().compose_node(parent, index)

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        seen: set[Any] = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, str):
                raise yaml.constructor.ConstructorError(
                    None, None, f"key {key!r} is not text", key_node.start_mark
                )
            if key in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"key '{key}' appears twice", key_node.start_mark
                )
            seen.add(key)
        return super().construct_mapping(node, deep)

    def construct_object(self, node: Any, deep: bool = False) -> Any:
        try:
            return super().construct_object(node, deep)
        except (ValueError, KeyError, IndexError):
            kind = node.tag.rpartition(":")[2]
            problem = f"{node.value[:20]!r} is not of type {kind}"
            raise yaml.constructor.ConstructorError(
                None, None, problem, node.start_mark
            ) from None

    def construct_decimal(self, node: Any) -> int:
        """Whole number; unlike in YAML 1.1, a leading zero does not make it octal."""
        return int(self.construct_scalar(node))


YAML_TAGS = {
    f"tag:yaml.org,2002:{kind}" for kind in ("map", "seq", "str", "null", "bool")
}
_Loader.yaml_implicit_resolvers = {
    first: [(tag, rule) for tag, rule in rules if tag in YAML_TAGS]
    for first, rules in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_Loader.yaml_constructors = {
    tag: construct
    for tag, construct in yaml.SafeLoader.yaml_constructors.items()
    if tag in YAML_TAGS | {"tag:yaml.org,2002:float", None}  # None refuses other tags
}
_Loader.add_constructor("tag:yaml.org,2002:int", _Loader.construct_decimal)
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:int", re.compile(r"^[-+]?\d+$"), list("-+0123456789")
)
_Loader.add_implicit_resolver("tag:yaml.org,2002:float", FLOAT, list("-+.0123456789"))


def parse_yaml(text: str, source: str) -> Any:
    """Plain data of YAML text; raises `SceneError` with line and column."""
    if not isinstance(text, str):
        raise SceneError(source, [f"is {type(text).__name__}, must be text"])
    if len(text) > LONGEST:
        raise SceneError(
            source,
            [f"has {len(text)} characters, must have <= {LONGEST} to be a scene"],
        )
    try:
        return yaml.load(text, Loader=_Loader)  # noqa: S506 - a SafeLoader
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        place = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        problem = error.problem or "cannot be read"
        raise SceneError(source, [f"{place}not valid YAML: {problem}"]) from None
    except yaml.YAMLError as error:
        raise SceneError(source, [f"not valid YAML: {error}"]) from None
    except RecursionError:
        raise SceneError(source, ["not valid YAML: nested too deeply"]) from None


class _Flow(dict[str, Any]):
    """A mapping to be written on one line."""


class _Dumper(SafeDumper):  # type: ignore[misc]
    """Safe dumper with fixed layout."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


_Dumper.add_representer(
    _Flow,
    lambda dumper, data: dumper.represent_mapping(
        "tag:yaml.org,2002:map", data.items(), flow_style=True
    ),
)
_Dumper.add_representer(
    list,
    lambda dumper, data: dumper.represent_sequence(
        "tag:yaml.org,2002:seq",
        data,
        flow_style=not any(isinstance(item, dict) for item in data),
    ),
)


def dump_yaml(data: dict[str, Any]) -> str:
    """Canonical YAML of the plain data of a scene."""
    sections = {key: _flowed(value) for key, value in data.items()}
    sections["objects"] = [
        {key: _flowed(value) for key, value in thing.items()}
        for thing in data["objects"]
    ]
    sections["environment"] = {
        key: _flowed(value) for key, value in data["environment"].items()
    }
    return yaml.dump(sections, Dumper=_Dumper, sort_keys=False, width=WIDTH)


def _flowed(value: Any) -> Any:
    return _Flow(value) if isinstance(value, dict) else value
