"""Field types of the scene schema: strict numbers with a unit, a tag and a kind.

Every field is tagged with what it gives away: *material*, *position*, *appearance*,
something of all (*derived*, as a time step that is fitted to stiffness and speed), or
nothing (*neutral*). The side-information regimes of a benchmark redact by tag, never by
name.
Every number is of a kind, by which edits scale, mirror and jitter it, never by name.
"""

from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal, get_args

import numpy as np
import numpy.typing as npt
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

from mpmworlds.sim.scene.palette import PALETTE, is_exact, nearest

TOLD_APART_BY: Final = ("object_type", "type", "constitutive_model")  # keys of unions
Tag = Literal["material", "position", "appearance", "derived", "neutral"]
Mirror = Literal["same", "across", "negated", "turned", "x_negated"]


@dataclass(frozen=True)
class Kind:
    """What edits do to a number of a kind.

    Attributes
    ----------
    mirror
        What it is when left and right are exchanged: the same, on the other side of
        the domain, with another sign (a vector: of its x component), or turned to the
        other side (an angle from the x axis).
    grows
        Whether it grows in proportion with its object.
    """

    mirror: Mirror = "same"
    grows: bool = False


KINDS: Final[dict[str, Kind]] = {
    "position": Kind("across"),  # in the domain
    "offset": Kind("x_negated", grows=True),  # from the center of an object
    "length": Kind(grows=True),
    "thickness": Kind(),  # of walls and blades
    "angle": Kind("negated"),  # of a thing that stands upright without it
    "heading": Kind("turned"),  # of a thing that points along x without it
    "span": Kind(),  # from one side to the other
    "swing": Kind("negated"),  # of a turn to and fro
    "displacement": Kind("x_negated"),
    "velocity": Kind("x_negated"),
    "acceleration": Kind("x_negated"),
    "spin": Kind("negated"),
    "speed": Kind("negated"),  # along a surface
    "rate": Kind(grows=True),  # of what leaves an object through its width
    **dict.fromkeys(("time", "frequency", "phase", "density", "stiffness"), Kind()),
    **dict.fromkeys(("strength", "viscosity", "friction", "strain"), Kind()),
    **dict.fromkeys(("fraction", "ratio", "exponent", "count"), Kind()),
    "setting": Kind(),  # of the solver
}


class Part(BaseModel):
    """A part of a scene: immutable, no unknown keys, finite numbers of one type."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False
    )

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        """Refuse a number without a kind: edits would leave it out."""
        for name, field in cls.model_fields.items():
            if field.annotation in NUMBERS and kind_of(cls, name) is None:
                raise TypeError(f"{cls.__name__}.{name} is a number without a kind")


def about(
    tag: Tag, text: str, unit: str = "", *, kind: str | None = None, **rule: Any
) -> Any:
    """Metadata of a field: its tag, meaning, unit, kind, and the rule it obeys.

    Parameters
    ----------
    tag
        What it gives away.
    text, unit
        What it is, for people.
    kind
        Name of its kind in `KINDS`; every number has one, and nothing else.
    rule
        Limits and default, as `pydantic.Field` takes them.
    """
    extra: dict[str, Any] = {"tag": tag} | ({"kind": kind} if kind else {})
    if kind is not None and kind not in KINDS:
        raise TypeError(f"kind = {kind!r}, must be one of {', '.join(KINDS)}")
    described = f"{text} [{unit}]" if unit else text
    return Field(description=described, json_schema_extra=extra, **rule)


def tag_of(model: type[BaseModel], name: str) -> Tag:
    """Tag of a field of a schema model."""
    tag = _extra(model, name).get("tag")
    if tag is None:
        raise TypeError(f"{model.__name__}.{name} carries no tag")
    return tag  # type: ignore[no-any-return]


def kind_of(model: type[BaseModel], name: str) -> str | None:
    """Kind of a field of a schema model; None if it is no number."""
    return _extra(model, name).get("kind")


def parts_of(annotation: Any) -> list[type[Part]]:
    """Classes of the schema that an annotation of a field allows, in its order."""
    if isinstance(annotation, type) and issubclass(annotation, Part):
        return [annotation]
    found = (part for inner in get_args(annotation) for part in parts_of(inner))
    return list(dict.fromkeys(found))


def _extra(model: type[BaseModel], name: str) -> dict[str, Any]:
    extra = model.model_fields[name].json_schema_extra
    return extra if isinstance(extra, dict) else {}


def _pair(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _exact(color: str) -> str:
    if not is_exact(color):
        raise ValueError(
            f"must be one of the {len(PALETTE)} palette colours, which survive video "
            f"encoding exactly; the nearest is '{nearest(color)}'"
        )
    return color.upper()


Vec2 = Annotated[tuple[float, float], BeforeValidator(_pair)]
Points = Annotated[
    tuple[Vec2, ...], BeforeValidator(_pair), Field(min_length=3, max_length=24)
]
NUMBERS = (float, int, tuple[float, float], tuple[Vec2, ...])  # as fields have them
Color = Annotated[str, Field(pattern="^#[0-9A-Fa-f]{6}$"), AfterValidator(_exact)]


def polygon_area(points: npt.ArrayLike) -> float:
    """Area [m^2] of a simple polygon, shape (n, 2) [m]; positive either way round."""
    x, y = np.asarray(points, np.float64).T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
