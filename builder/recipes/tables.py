"""What generation draws from: shares, typical values, shapes, motions and widths.

A set of tables has a version in ``params.yaml``, and whatever is drawn names the one
that it is drawn from. A set that scenes were drawn from is never changed: a new entry
is a new version, for new batches, and moves nothing.
"""

from functools import cache
from importlib.resources import files
from typing import Annotated, Any, Final

import yaml
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)

from mpmworlds.sim.scene.errors import describe
from mpmworlds.sim.scene.fields import KINDS
from mpmworlds.sim.scene.objects import CONTACTS, MATERIALS, SHAPES


def _sorted(data: Any) -> Any:
    """A mapping in the order of its keys: a file may have them in any order."""
    return dict(sorted(data.items())) if isinstance(data, dict) else data


Sorted = BeforeValidator(_sorted)
Shares = Annotated[dict[str, Annotated[float, Field(gt=0.0)]], Sorted]
Values = Annotated[dict[str, Any], Sorted]
FIRST: Final = "v1"


class TableError(ValueError):
    """Tables that nothing can be drawn from."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Width(_Part):
    """How far a perturbation may change a number.

    Attributes
    ----------
    shift
        By at most this much either way, in the unit of the number.
    factor
        By at most this factor either way.
    """

    shift: float = Field(default=0.0, ge=0.0)
    factor: float = Field(default=1.0, ge=1.0)


class Tables(_Part):
    """One version of all tables; names and shares, which need not add up to one.

    Attributes
    ----------
    objects, materials_per_scene
        Numbers of objects, and of materials, of a parent.
    materials
        Materials of matter, for parents and for edits.
    typical
        Values of each material.
    spread
        Least and largest factor on a typical value, by the kind of the number.
    contacts
        Contact laws of the walls of a parent.
    edits
        Edits that make children.
    motions
        Motions of colliders.
    belts
        Shapes that may be conveyors.
    set_in_motion
        Chances that an object of a parent gets another motion, by its type.
    new_shapes
        Numbers of shapes, in radii of a circle of the same area.
    reshaped
        Shapes that may be exchanged.
    jitter
        How far perturbations go, by the kind of the number.
    """

    objects: Annotated[dict[int, float], Sorted]
    materials_per_scene: Annotated[dict[int, float], Sorted]
    materials: Shares
    typical: Annotated[dict[str, Values], Sorted]
    spread: Annotated[dict[str, tuple[float, float]], Sorted]
    contacts: Shares
    edits: Shares
    motions: Shares
    belts: tuple[str, ...]
    set_in_motion: Annotated[dict[str, float], Sorted]
    new_shapes: Annotated[dict[str, Values], Sorted]
    reshaped: tuple[str, ...]
    jitter: Annotated[dict[str, Width], Sorted]

    @model_validator(mode="after")
    def _names_are_known(self) -> "Tables":
        for what, names, known in (
            ("materials", self.materials, self.typical),
            ("typical", self.typical, MATERIALS),
            ("spread", self.spread, KINDS),
            ("contacts", self.contacts, CONTACTS),
            ("belts", self.belts, SHAPES),
            ("new_shapes", self.new_shapes, SHAPES),
            ("reshaped", self.reshaped, SHAPES),
            ("jitter", self.jitter, KINDS),
        ):
            for name in names:
                if name not in known:
                    raise ValueError(
                        f"{what}: {name!r}, must be one of {', '.join(sorted(known))}"
                    )
        return self


def read_tables(data: Any, version: str) -> Tables:
    """Read one version of the tables.

    Parameters
    ----------
    data
        The mapping ``tables`` of a file of parameters: tables by version.
    version
        The one to read; if it is not there, it is looked for among those of the
        package.

    Raises
    ------
    TableError
        If there is no such version, or something is wrong with it.
    """
    own = data if isinstance(data, dict) else {}
    found = own.get(version, packaged().get(version))
    if found is None:
        known = ", ".join(sorted({*own, *packaged()}))
        raise TableError(f"tables: there is no version {version!r}, only {known}")
    try:
        return Tables.model_validate(found)
    except ValidationError as error:
        faults = "; ".join(describe(error, found))
        raise TableError(f"tables: {version}: {faults}") from None


@cache
def packaged() -> dict[str, Any]:
    """Tables of the package's own ``params.yaml``, by version."""
    text = files("mpmworlds").joinpath("params.yaml").read_text("utf-8")
    found: dict[str, Any] = yaml.safe_load(text).get("tables") or {}
    return found


@cache
def first_tables() -> Tables:
    """The first version of the package's tables."""
    return read_tables({}, FIRST)
