"""The numbers of an object by their kinds, and what scaling and mirroring do to them.

Nothing here knows a field by its name: what a number is stands in the schema.
"""

from collections.abc import Callable, Iterator
from functools import cache
from typing import Any, NamedTuple, get_args

from pydantic import BaseModel, ValidationError

from mpmworlds.builder.recipes.objects import Data, NoRoomError, rounded
from mpmworlds.sim.program.features.shape import Shape
from mpmworlds.sim.scene.fields import KINDS, TOLD_APART_BY, Part, kind_of, parts_of
from mpmworlds.sim.scene.objects import SHAPES
from mpmworlds.sim.scene.sections import Sections


class Quantity(NamedTuple):
    """A number, or a list of them, of an object.

    Attributes
    ----------
    part, key
        Mapping that holds it, and its key there.
    kind
        Name of its kind in `KINDS`.
    most
        Largest value that it may have, if there is one.
    """

    part: Data
    key: str
    kind: str
    most: float | None

    @property
    def value(self) -> Any:
        """What it is."""
        return self.part[self.key]

    def change(self, function: Callable[[float], float]) -> None:
        """Make it what a function gives for it, in place."""
        self.part[self.key] = _mapped(self.value, function)


def quantities(thing: Data) -> Iterator[Quantity]:
    """All numbers of an object, in the order of the schema."""
    yield from _numbers(thing, _model(Sections, "objects", thing))


def scale(thing: Data, factor: float) -> None:
    """Scale an object in place: its lengths, and what leaves it through its width."""
    for quantity in quantities(thing):
        if KINDS[quantity.kind].grows:
            quantity.change(lambda x: rounded(x * factor))


def mirror(thing: Data) -> None:
    """Exchange left and right of an object, in place."""
    for quantity in quantities(thing):
        rule = KINDS[quantity.kind].mirror
        if rule == "negated":
            quantity.change(lambda x: 0.0 - x)
        elif rule == "turned":
            quantity.change(lambda x: (360.0 - x) % 360.0 - 180.0)
        elif rule == "across":
            quantity.value[0] = rounded(1.0 - quantity.value[0])
        elif rule == "x_negated":
            value = quantity.value
            for point in value if isinstance(value[0], list) else [value]:
                point[0] = 0.0 - point[0]


def shape_of(data: Data) -> Shape:
    """A shape of plain data; raises `NoRoomError` if there can be no such shape."""
    try:
        return SHAPES[data["type"]].model_validate(data)
    except ValidationError as error:
        fault = error.errors()[0]["msg"]
        raise NoRoomError(f"there is no such {data['type']} ({fault})") from None


def _mapped(value: Any, function: Callable[[float], float]) -> Any:
    if isinstance(value, list):
        return [_mapped(item, function) for item in value]
    return function(value)


def _numbers(part: Data, model: type[BaseModel]) -> Iterator[Quantity]:
    for key, field in model.model_fields.items():
        if key not in part:
            continue
        kind = kind_of(model, key)
        if kind is not None:
            limits = (getattr(rule, "le", None) for rule in field.metadata)
            most = next((limit for limit in limits if limit is not None), None)
            yield Quantity(part, key, kind, most)
        elif isinstance(part[key], dict):
            yield from _numbers(part[key], _model(model, key, part[key]))


def _model(model: type[BaseModel], key: str, data: Data) -> type[Part]:
    """The schema class of a part of plain data."""
    name, members = _members(model, key)
    return members[data[name] if name else None]


@cache
def _members(
    model: type[BaseModel], key: str
) -> tuple[str | None, dict[Any, type[Part]]]:
    """What tells the classes that a field may have apart, and them by its values."""
    kinds = parts_of(model.model_fields[key].annotation)
    if len(kinds) == 1:
        return None, {None: kinds[0]}
    name = next(n for n in TOLD_APART_BY
                if all(n in kind.model_fields for kind in kinds))  # fmt: skip
    values = [get_args(kind.model_fields[name].annotation)[0] for kind in kinds]
    return name, dict(zip(values, kinds, strict=True))
