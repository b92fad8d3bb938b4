"""What a regime tells, as a scene with gaps; what it tells is never sought."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from mpmworlds.baselines.filling import told_scene
from mpmworlds.loaders.regimes import COLOR_WORDS, color_said
from mpmworlds.sim.scene.fields import TOLD_APART_BY
from mpmworlds.sim.scene.objects import EMISSIONS, MATERIALS, MOTIONS, SHAPES

Data = dict[str, Any]

_SENTENCE: Final = re.compile(
    r"(?P<name>[a-z][a-z0-9_]*): (?P<looks>[^,]+), (?P<rest>[^.]+)\."
)
_KINDS: Final = {
    f"{kind.replace('_', ' ')}": kind
    for kind in ("dynamic_body", "static_collider", "kinematic_collider", "emitter")
}
_THIRDS: Final = {"left": 1 / 6, "bottom": 1 / 6, "middle": 0.5, "center": 0.5}
_THIRDS_FAR: Final = {"right": 5 / 6, "top": 5 / 6}


@dataclass(frozen=True)
class Told:
    """A scene with gaps."""

    simulation: Data = field(default_factory=dict)
    """What is known of its resolution and length."""
    environment: Data = field(default_factory=dict)
    """What is known of gravity and walls."""
    objects: tuple[Data, ...] = ()
    """What is known of its objects; none if not even their number is."""
    pulls: tuple[int, int] | None = None
    """Signs of gravity, where only they are told."""
    near: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """By the names of objects about where they are, where only that is told [m]."""

    @property
    def anything(self) -> bool:
        """Whether objects are told."""
        return bool(self.objects)


def read_side(text: str) -> Told:
    """Read side information of any regime.

    Raises
    ------
    ValueError
        If it is neither nothing, nor a scene with gaps, nor a caption.
    """
    if not text.strip():
        return Told()
    data = told_scene(text)
    if data is not None:
        return Told(
            dict(data.get("simulation") or {}),
            dict(data.get("environment") or {}),
            tuple(data["objects"]),
        )
    sentences = list(_SENTENCE.finditer(text))
    if not sentences:
        raise ValueError(
            "side information is neither a scene nor a caption; give what "
            "`mpmworlds.loaders.regimes` tells"
        )
    things = [_captioned(found) for found in sentences]
    near = {
        thing["name"]: _place(found["rest"])
        for thing, found in zip(things, sentences, strict=True)
    }
    words = text[: sentences[0].start()].lower()
    pulls = (
        ("right" in words) - ("left" in words),
        ("up" in words) - ("down" in words),
    )
    return Told(objects=tuple(things), pulls=pulls, near=near)


def _captioned(found: "re.Match[str]") -> Data:
    """An object of a caption, in plain data with gaps."""
    looks = found["looks"]
    color = color_said(looks)
    shape = looks[len(COLOR_WORDS.get(color, "")) + 1 :].replace(" ", "_")
    parts = [part.strip() for part in found["rest"].split(",")]
    kind = _KINDS.get(parts[0])
    if not color or kind is None or shape not in SHAPES:
        raise ValueError(f"caption {found[0]!r}: is of no object that scenes have")
    thing: Data = {
        "name": found["name"],
        "object_type": kind,
        "shape": {"type": shape},
        "visualization": {"color": color},
    }
    for part in parts[1:]:
        what, _, rest = part.partition(" ")
        name = rest.replace(" ", "_")
        if what == "material" and name in MATERIALS:
            thing["physics_properties"] = {"constitutive_model": name}
        if what == "motion" and name in MOTIONS:
            thing["kinematics"] = {"type": name}
        if what == "motion" and name in EMISSIONS:
            thing["emission"] = {"type": name}
    return thing


def _place(rest: str) -> tuple[float, float]:
    """Middle of the ninth of the domain that a caption names [m]."""
    words = rest.rpartition("at the ")[2].split()
    row, column = (words * 2)[:2]
    thirds = {**_THIRDS, **_THIRDS_FAR}
    return thirds.get(column, 0.5), thirds.get(row, 0.5)


def over(told: Any, found: Any) -> Any:
    """What is told, with its gaps filled by what was found."""
    if told is None:
        return found
    if not isinstance(told, Mapping) or not isinstance(found, Mapping):
        return told
    if any(told.get(key, found.get(key)) != found.get(key) for key in TOLD_APART_BY):
        return dict(told)
    return {key: over(told.get(key), found.get(key)) for key in {**found, **told}}
