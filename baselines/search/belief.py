"""What a search believes, and how sure it is, in words for people."""

from collections.abc import Iterator, Sequence
from typing import Any, Final

from mpmworlds.baselines.search.guess import Thing
from mpmworlds.baselines.search.infer import Found
from mpmworlds.baselines.search.perception.colors import EXACT
from mpmworlds.baselines.search.trials.readings import Trial
from mpmworlds.sim.scene.palette import PALETTE

SURE: Final = 0.03  # loss by which everything else is worse
LIKELY: Final = 0.008
CLOSE: Final = 0.12  # loss of a prefix that is drawn nearly as it is seen
POOR: Final = 0.30
SHORT: Final = 10  # frames that tell little
_NAMES: Final = {color: name.replace("_", " ") for name, color in PALETTE.items()}


def believed(found: Found) -> list[str]:
    """Lines about the whole, then about each thing."""
    return [*_whole(found), *(_thing(found, k) for k in range(len(found.sight.things)))]


def confidence(found: Found) -> str:
    """``high``, ``middle`` or ``low``: how near the best scene's prefix is."""
    loss, seen = found.trials[0].loss, found.sight.labels
    if loss > POOR or seen.exact < EXACT or len(seen.numbers) < SHORT:
        return "low"
    return "high" if loss < CLOSE else "middle"


def _whole(found: Found) -> Iterator[str]:
    best, seen = found.trials[0], found.sight.labels
    yield f"confidence {confidence(found)}: loss {best.loss:.3f} of the prefix"
    if seen.exact < EXACT:
        yield (
            f"{1 - seen.exact:.1%} of pixels have no colour of scenes: they were taken "
            "for the nearest one"
        )
    if len(seen.numbers) < SHORT:
        yield f"{len(seen.numbers)} frames tell little of motion"
    gravity = best.data["environment"]["gravity"]
    sure = found.sight.gravities[0].sure and found.sight.gravities[0].value == tuple(
        gravity
    )
    how = "seen in flight" if sure else "not seen in flight: a guess that runs bear out"
    yield f"gravity ({gravity[0]:.2f}, {gravity[1]:.2f}) m/s^2, {how}"
    walls = best.data["environment"]["walls"]["contact"]
    yield f"walls {walls}, {_margin(found, lambda data: _walls(data) != walls)}"


def _walls(data: Any) -> str:
    return str(data["environment"]["walls"]["contact"])


def _thing(found: Found, number: int) -> str:
    thing, data = found.sight.things[number], found.trials[0].data["objects"][number]
    color = _NAMES.get(data["visualization"]["color"], "unnamed")
    words = [f"{color} {data['shape']['type']}", data["object_type"].replace("_", " ")]
    words += _motion(thing, data)
    if "physics_properties" in data:
        name = data["physics_properties"]["constitutive_model"]
        margin = _margin(found, lambda other: _material(other, number) != name)
        words.append(f"of {name}, {margin}")
    if thing.track is not None and thing.track.shared:
        words.append("shares its colour, so pixels are of the nearest one")
    if thing.track is None:
        words.append("told, but not seen")
    return ", ".join(words)


def _motion(thing: Thing, data: Any) -> Iterator[str]:
    if thing.fit is not None:
        yield f"shape overlaps by {thing.fit.iou:.3f}"
    if "kinematics" in data:
        kind = data["kinematics"]["type"]
        laws = [law for law in thing.laws if law.kinematics["type"] == kind]
        yield f"{kind}s" + (f" within {laws[0].error:.1f} px" if laws else ", assumed")
    if thing.flight is not None:
        yield f"flies freely for {thing.flight.frames} frames"
    if thing.nozzles:
        kind, misfit = data["emission"]["type"], thing.nozzles[0].error
        yield f"pours as {kind} (misfit {misfit:.2f}); when it stops is not seen"


def _material(data: Any, number: int) -> str:
    properties = data["objects"][number].get("physics_properties", {})
    return str(properties.get("constitutive_model", ""))


def _margin(found: Found, differs: Any) -> str:
    """How much worse the best scene is that differs, in words."""
    rivals: Sequence[Trial] = [t for t in found.search.trials if differs(t.data)]
    if not rivals:
        return "nothing else was tried"
    margin = min(t.loss for t in rivals) - found.trials[0].loss
    word = "sure" if margin > SURE else "likely" if margin > LIKELY else "a guess"
    return f"{word} (anything else is worse by {margin:.3f})"
