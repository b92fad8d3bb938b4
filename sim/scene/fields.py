"""Field types of the scene schema: strict numbers with a unit and a tag.

Every field is tagged with what it gives away: *material*, *position*, *appearance* or
*neutral*. The side-information regimes of a benchmark redact by tag, never by name.
"""

from typing import Annotated, Any, Literal

import numpy as np
import numpy.typing as npt
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

from mpmworlds.sim.scene.palette import PALETTE, is_exact, nearest

Tag = Literal["material", "position", "appearance", "neutral"]


class Part(BaseModel):
    """A part of a scene: immutable, no unknown keys, finite numbers of one type."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False
    )


def about(tag: Tag, text: str, unit: str = "", **rule: Any) -> Any:
    """Metadata of a field: its tag, meaning, unit, and the rule its value obeys."""
    described = f"{text} [{unit}]" if unit else text
    return Field(description=described, json_schema_extra={"tag": tag}, **rule)


def tag_of(model: type[BaseModel], name: str) -> Tag:
    """Tag of a field of a schema model."""
    extra = model.model_fields[name].json_schema_extra
    if not isinstance(extra, dict) or "tag" not in extra:
        raise TypeError(f"{model.__name__}.{name} carries no tag")
    return extra["tag"]  # type: ignore[return-value]


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
Color = Annotated[str, Field(pattern="^#[0-9A-Fa-f]{6}$"), AfterValidator(_exact)]


def polygon_area(points: npt.ArrayLike) -> float:
    """Area [m^2] of a simple polygon, shape (n, 2) [m]; positive either way round."""
    x, y = np.asarray(points, np.float64).T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
