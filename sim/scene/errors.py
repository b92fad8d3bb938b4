"""Errors of scenes: which file, object, field and value break which rule."""

from typing import Any

from pydantic import ValidationError

RULES = {
    "greater_than": "must be > {gt}",
    "greater_than_equal": "must be >= {ge}",
    "less_than": "must be < {lt}",
    "less_than_equal": "must be <= {le}",
    "literal_error": "must be {expected}",
    "finite_number": "must be a finite number",
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "string_type": "must be text in quotes",
    "tuple_type": "must be a list",
    "model_type": "must be a mapping",
    "model_attributes_type": "must be a mapping",
    "too_short": "needs at least {min_length} entries",
    "too_long": "takes at most {max_length} entries",
    "string_pattern_mismatch": "must match {pattern}",
    "union_tag_invalid": "must be one of {expected_tags}",
}

LONGEST = 60  # characters of a name or a value that an error shows
LONGEST_FAULT = 500  # characters of a fault that an error shows
MOST_SHOWN = 20  # faults that an error shows


class SceneError(ValueError):
    """A scene that is not valid.

    Attributes
    ----------
    source
        What the scene was read from.
    faults
        One line for each thing wrong.
    rule
        Name of the first rule of `checks.CHECKS` that is broken; "form" if it is no
        rule of those, but a field or the text.
    """

    def __init__(self, source: str, faults: list[str], rule: str = "form") -> None:
        self.source, self.faults, self.rule = source, faults, rule
        start = _escaped(source)
        lines = [
            f"{start}: {_cut(_escaped(fault), LONGEST_FAULT)}"
            for fault in faults[:MOST_SHOWN]
        ]
        if len(faults) > MOST_SHOWN:
            lines.append(f"{start}: and {len(faults) - MOST_SHOWN} more")
        super().__init__("\n".join(lines))

    def __reduce__(self) -> tuple[type["SceneError"], tuple[str, list[str], str]]:
        """What it is made of, so that it comes whole from another process."""
        return SceneError, (self.source, self.faults, self.rule)


def raise_faults(source: str, faults: list[tuple[str, str]]) -> None:
    """Raise `SceneError` if there are faults: names of rules, and what breaks them."""
    if faults:
        raise SceneError(source, [fault for _, fault in faults], faults[0][0])


def _escaped(text: str) -> str:
    """A text on one line, without what a terminal would obey."""
    if text.isprintable():
        return text
    return "".join(
        c if c.isprintable() else c.encode("unicode_escape").decode() for c in text
    )


def _cut(text: str, longest: int = LONGEST) -> str:
    return text if len(text) <= longest else text[: longest - 3] + "..."


def describe(error: ValidationError, data: Any) -> list[str]:
    """One line for each fault that pydantic found in `data`."""
    return [_line(fault, data) for fault in error.errors()]


def _line(fault: Any, data: Any) -> str:
    keys, where, node = [], "", data
    for depth, step in enumerate(fault["loc"], 1):
        absent = fault["type"] == "missing" and depth == len(fault["loc"])
        if isinstance(node, dict) and step in node:
            node = node[step]
        elif isinstance(node, list | tuple) and isinstance(step, int):
            node = node[step] if step < len(node) else None
        elif isinstance(node, dict) and not absent:
            continue  # pydantic names the variant of a union; the file does not
        else:
            node = None
        keys.append(step)
    if len(keys) > 1 and keys[0] == "objects":
        thing = data["objects"][keys[1]]
        name = thing.get("name") if isinstance(thing, dict) else None
        where = f"objects[{keys[1]}]" + (f" '{_cut(str(name))}'" if name else "") + ": "
        keys = keys[2:]
    steps = (f"[{k}]" if isinstance(k, int) else f".{_cut(k)}" for k in keys)
    field = "".join(steps)[1:]
    return where + _fault(fault, field, node)


def _fault(fault: Any, field: str, value: Any) -> str:
    kind, context = fault["type"], fault.get("ctx", {})
    if kind == "missing":
        return f"{field} is missing; add it"
    if kind == "extra_forbidden":
        return f"{field} is not a known key; remove it or check its spelling"
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        key = context["discriminator"].strip("'")
        what, field = field or "object", f"{field}.{key}".removeprefix(".")
        if kind == "union_tag_not_found":
            return f"{field} is missing; it says which kind of {what} this is"
        value = value[key]
    if kind == "value_error":
        rule = str(context["error"])
        return rule if rule.startswith(field) else f"{field} = {_shown(value)}, {rule}"
    rule = RULES[kind].format(**context) if kind in RULES else fault["msg"]
    return f"{field or 'object'} = {_shown(value)}, {rule}"


def _shown(value: Any) -> str:
    """A value as its file has it, cut short if it is long."""
    return _cut(repr(list(value) if isinstance(value, tuple) else value))
