"""Regimes: what a model is told of a scene, besides the frames that it is shown.

What a regime hides follows from the tags of the schema, never from names: two scenes
that differ only in what is hidden are told in the same words.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any, Final

from mpmworlds.sim.scene.fields import Part, Tag, tag_of
from mpmworlds.sim.scene.objects import AnyObject
from mpmworlds.sim.scene.palette import PALETTE
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.sim.scene.text import dump_yaml

DEFAULT: Final = "frames_only"
COLOR_WORDS: Final = {color: name.replace("_", " ") for name, color in PALETTE.items()}
"""Colours of the palette as captions say them."""
_COLUMNS: Final = ("left", "middle", "right")
_ROWS: Final = ("bottom", "middle", "top")


@dataclass(frozen=True)
class Regime:
    """One regime.

    Attributes
    ----------
    name
        What it is called in results.
    meaning
        What is told, for people.
    tell
        Text for a scene; empty if nothing is told.
    blind
        Whether nothing is told of any scene, so that none need be read.
    """

    name: str
    meaning: str
    tell: Callable[[Scene], str]
    blind: bool = False


def _nothing(scene: Scene) -> str:
    return ""


def redacted(scene: Scene, hidden: Tag) -> str:
    """A scene as YAML without what gives one kind of thing away.

    Parameters
    ----------
    scene
        The scene.
    hidden
        Tag of what is left out; what is derived from all goes with it.

    Returns
    -------
    str
        The rest, in the layout of a scene file. It is no valid scene.
    """
    return dump_yaml(_visible(scene, scene.to_data(), {hidden, "derived"}))


def _visible(part: Part, data: Mapping[str, Any], hidden: set[str]) -> dict[str, Any]:
    """The plain data of a part whose tags are not hidden, in the same order."""
    names = {
        field.alias or name: name for name, field in type(part).model_fields.items()
    }
    found: dict[str, Any] = {}
    for key, value in data.items():
        name = names[key]
        if tag_of(type(part), name) in hidden:
            continue
        inner = getattr(part, name)
        if isinstance(inner, Part):
            value = _visible(inner, value, hidden)
        elif isinstance(inner, tuple) and isinstance(inner[0], Part):
            value = [_visible(p, v, hidden) for p, v in zip(inner, value, strict=True)]
        if value != {}:  # of which nothing is left
            found[key] = value
    return found


def caption(scene: Scene) -> str:
    """A scene in plain words, with its materials, without its numbers.

    Parameters
    ----------
    scene
        The scene.

    Returns
    -------
    str
        A sentence for each object, and one for gravity.
    """
    x, y = scene.environment.gravity
    ways = [word for word, there in (("left", x < 0), ("right", x > 0)) if there]
    ways += [word for word, there in (("down", y < 0), ("up", y > 0)) if there]
    pull = f"Gravity pulls {' and '.join(ways)}." if ways else "There is no gravity."
    return " ".join([pull, *(_sentence(thing) for thing in scene.objects)])


def color_said(looks: str) -> str:
    """Colour with whose words the looks of a caption begin; empty if with none."""
    begun = [c for c, words in COLOR_WORDS.items() if looks.startswith(f"{words} ")]
    return max(begun, key=lambda color: len(COLOR_WORDS[color]), default="")


def _sentence(thing: AnyObject) -> str:
    """What an object is, of what, where, and how it moves."""
    looks = f"{COLOR_WORDS[thing.visualization.color]} {thing.shape.type}"
    words = [looks, thing.object_type]
    for name in type(thing).model_fields:
        part = getattr(thing, name)
        if hasattr(part, "constitutive_model"):
            words.append(f"material {part.constitutive_model}")
        elif name in ("kinematics", "emission"):
            words.append(f"motion {part.type}")
    row, column = (
        names[min(int(3 * place), 2)]
        for names, place in zip(
            (_ROWS, _COLUMNS), reversed(thing.shape.center), strict=True
        )
    )
    where = "center" if row == column else f"{row} {column}"
    told = ", ".join([*words, f"at the {where}"]).replace("_", " ")
    return f"{thing.name}: {told}."


REGIMES: Final[Mapping[str, Regime]] = MappingProxyType(
    {
        regime.name: regime
        for regime in (
            Regime("frames_only", "nothing", _nothing, blind=True),
            Regime("full_config", "the scene, as its YAML", Scene.to_yaml),
            Regime(
                "no_materials",
                "the scene without materials and what follows from them",
                partial(redacted, hidden="material"),
            ),
            Regime(
                "no_positions",
                "the scene without places, angles and velocities",
                partial(redacted, hidden="position"),
            ),
            Regime("caption", "the scene in words, without numbers", caption),
        )
    }
)
"""The four of the paper, and captions."""


def regime_named(name: str) -> Regime:
    """Look up a regime; raises `ValueError` with their names if there is none."""
    if name not in REGIMES:
        raise ValueError(f"regime {name!r}: unknown, must be one of {list(REGIMES)}")
    return REGIMES[name]
