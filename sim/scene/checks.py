"""Rules that no single field can see: layout, looks, stability, emission.

Each check takes a scene and the numbers of the objects to look at, and yields faults; a
scene without any can be linked and run.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from itertools import combinations
from typing import Any

import numpy as np

from mpmworlds.sim.program.features.motion import REST, Pose
from mpmworlds.sim.scene.fields import polygon_area
from mpmworlds.sim.scene.objects import MATERIALS, Emitter
from mpmworlds.sim.scene.outlines import Outline, centroid, paint
from mpmworlds.sim.scene.palette import hue_difference, saturation
from mpmworlds.sim.scene.sections import Sections
from mpmworlds.sim.scene.steps import ROUNDED, fastest_step, spacing, speed_of

RASTER = 1024  # pixels per side at which overlaps are looked for
HUE_STEP = 25.0  # least hue difference of two colours in one scene [deg]
MOST_PARTICLES = 200_000
LEAST_PARTICLES = 16
MOST_GRAVITY = 1000.0  # m/s^2
MOST_SPEED = 100.0  # prescribed, m/s
COLLIDERS = ("static_collider", "kinematic_collider")
MATERIAL_WORDS = (
    *MATERIALS,
    *("water", "honey", "jelly", "rigid", "viscous", "rubber", "mud", "slime"),
)


def check_scene(scene: Sections, only: int | None = None) -> list[tuple[str, str]]:
    """Every fault of a scene whose fields are valid one by one, after its rule's name.

    If only one object differs from a scene without faults, its number is enough to find
    those of the new scene.
    """
    numbers = range(len(scene.objects)) if only is None else (only,)
    return [
        (rule, fault)
        for rule, check in CHECKS.items()
        for fault in check(scene, numbers)
    ]


def jet_width(emitter: Emitter) -> float:
    """Extent of an emitter's nozzle across its velocity [m]."""
    vx, vy = emitter.emission.velocity
    angle = emitter.shape.angle() - math.atan2(vy, vx)
    width, height = map(float, emitter.shape.size)
    return abs(width * math.sin(angle)) + abs(height * math.cos(angle))


def _label(scene: Sections, i: int) -> str:
    return f"objects[{i}] '{scene.objects[i].name}'"


def _check_names(scene: Sections, numbers: Sequence[int]) -> Iterator[str]:
    names = [thing.name for thing in scene.objects]
    for i in numbers:
        name = names[i]
        if name in names[:i]:
            yield f"{_label(scene, i)}: name is taken; names must be unique"
        word = next((w for w in MATERIAL_WORDS if w in name), None)
        if word:
            yield (
                f"{_label(scene, i)}: name gives away '{word}'; use a neutral name "
                f"such as 'object_{i}'"
            )


def _check_particles(scene: Sections, numbers: Sequence[int]) -> Iterator[str]:
    area, total = spacing(scene) ** 2, 0.0
    for i, thing in enumerate(scene.objects):
        if thing.object_type == "dynamic_body":
            count = sum(map(polygon_area, thing.shape.local_outline())) / area
            if count < LEAST_PARTICLES:
                yield (
                    f"{_label(scene, i)}: shape holds {count:.0f} particles, must hold "
                    f">= {LEAST_PARTICLES}; enlarge it or raise grid_resolution"
                )
            total += count
        elif thing.object_type == "emitter":
            total += thing.emission.count(spacing(scene))
    if all(thing.object_type in COLLIDERS for thing in scene.objects):
        yield "objects hold no particles; add a dynamic_body or an emitter"
    if total > MOST_PARTICLES:
        yield (
            f"objects hold {total:.0f} particles, must be <= {MOST_PARTICLES}; lower "
            "grid_resolution, particles_per_cell or emission.rate"
        )


def _check_jets(scene: Sections, numbers: Sequence[int]) -> Iterator[str]:
    for i in numbers:
        thing = scene.objects[i]
        if thing.object_type != "emitter":
            continue
        for fault in thing.emission.faults(jet_width(thing), spacing(scene)):
            yield f"{_label(scene, i)}: {fault}"


def _check_speeds(scene: Sections, numbers: Sequence[int]) -> Iterator[str]:
    gravity = math.hypot(*scene.environment.gravity)
    if gravity > MOST_GRAVITY:
        yield (
            f"environment.gravity is {gravity:g} m/s^2, must be <= {MOST_GRAVITY:g}; "
            "lower it"
        )
    for i in numbers:
        speed = speed_of(scene.objects[i])
        if speed > MOST_SPEED:
            yield (
                f"{_label(scene, i)}: moves at up to {speed:g} m/s, must be <= "
                f"{MOST_SPEED:g}; lower its velocities"
            )


def _check_tearing(scene: Sections, numbers: Sequence[int]) -> Iterator[str]:
    """Fast blades tear particles of a body further apart than the grid can see."""
    for i, j in _movers_beside(scene, numbers):
        matter: Any = scene.objects[j]
        if matter.object_type in COLLIDERS:
            continue
        speed, most = speed_of(scene.objects[i]), matter.physics_properties.TEARS_AT
        if speed > most:
            yield (
                f"{_label(scene, i)}: moves at up to {speed:g} m/s, must be <= "
                f"{most:g}, or it tears {_label(scene, j)}; slow it down"
            )


def _check_output(scene: Sections, numbers: Sequence[int]) -> Iterator[str]:
    if scene.output.resolution % 2:
        yield (
            f"output.resolution = {scene.output.resolution}, must be even to be "
            f"encoded; use {scene.output.resolution + 1}"
        )


def _check_stability(scene: Sections, numbers: Sequence[int]) -> Iterator[str]:
    if all(thing.object_type in COLLIDERS for thing in scene.objects):
        return
    bound, name = fastest_step(scene)
    if scene.simulation.time_step_dt > bound * (1.0 + ROUNDED):
        yield (
            f"simulation.time_step_dt = {scene.simulation.time_step_dt:g}, must be <= "
            f"{bound:.3g} for '{name}' to be stable; lower it and raise "
            "substeps_per_frame, or take a softer or less viscous material"
        )


def _check_colors(scene: Sections, numbers: Sequence[int]) -> Iterator[str]:
    for i, j in _pairs(scene, numbers):
        a, b = (scene.objects[k].visualization.color for k in (i, j))
        if a == b or min(saturation(a), saturation(b)) < 0.2:
            continue
        if hue_difference(a, b) < HUE_STEP:
            yield (
                f"{_label(scene, j)}: color = '{b}' is too near to '{a}' of "
                f"{_label(scene, i)}; take the same, or a hue {HUE_STEP:.0f} degrees "
                "away"
            )


def _pairs(scene: Sections, numbers: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Pairs of objects of which one is looked at."""
    for i, j in combinations(range(len(scene.objects)), 2):
        if i in numbers or j in numbers:
            yield i, j


def _poses(thing: Any) -> list[Pose]:
    """Displacements between which an object moves."""
    if thing.object_type != "kinematic_collider":
        return [REST]
    poses: list[Pose] = thing.kinematics.poses()
    return poses


def _moves(thing: Any) -> bool:
    """Whether an object is a collider that changes its place."""
    return len(_poses(thing)) > 1


def _movers_beside(
    scene: Sections, numbers: Sequence[int]
) -> Iterator[tuple[int, int]]:
    """Pairs of which one is looked at: a collider that moves, and another object."""
    for i, j in _pairs(scene, numbers):
        for one, other in ((i, j), (j, i)):
            if _moves(scene.objects[one]):
                yield one, other


def _extent(thing: Any) -> tuple[float, float]:
    """Least and largest coordinate [m] of an object on its way, and of its births."""
    corners = np.concatenate(thing.shape.local_outline()) @ [1, 1j]
    center = complex(*thing.shape.center)
    turn = np.exp(1j * thing.shape.angle())
    parts = [
        corners * (turn * np.exp(1j * angle)) + (center + complex(*shift))
        for shift, angle in _poses(thing)
    ]
    if thing.object_type == "emitter":
        vx, vy = thing.emission.velocity
        width = jet_width(thing)
        births = {
            "size": (thing.emission.depth(width), width),
            "angle_deg": math.degrees(math.atan2(vy, vx)),
        }
        nozzle = thing.shape.model_copy(update=births).outline()
        parts.append(np.concatenate(nozzle) @ [1, 1j])
    points = np.concatenate(parts).view(np.float64)
    return float(points.min()), float(points.max())


def _check_domain(scene: Sections, numbers: Sequence[int]) -> Iterator[str]:
    cell = 1.0 / scene.simulation.grid_resolution
    for i in numbers:
        thing = scene.objects[i]
        collider = thing.object_type in COLLIDERS
        edge = 0.0 if collider else scene.environment.walls.thickness_cells * cell
        low, high = _extent(thing)
        if low < edge - 1e-9 or high > 1.0 - edge + 1e-9:
            yield (
                f"{_label(scene, i)}: shape reaches from {low:.3f} to {high:.3f} m"
                f"{' on its way' if _moves(thing) else ''}, must stay within "
                f"[{edge:.3f}, {1.0 - edge:.3f}] m; move or shrink it"
            )


def _check_overlap(scene: Sections, numbers: Sequence[int]) -> Iterator[str]:
    outlines = [_outline(thing.shape) for thing in scene.objects]
    for i, j in _pairs(scene, numbers):
        if all(scene.objects[k].object_type in COLLIDERS for k in (i, j)):
            continue
        if overlap(outlines[i], outlines[j]):
            yield (
                f"{_label(scene, j)}: shape overlaps {_label(scene, i)} at the start; "
                "move one of them"
            )


def _check_sweeps(scene: Sections, numbers: Sequence[int]) -> Iterator[str]:
    """Matter between a collider that stays and one that passes through it has no way.

    A blade that passes a body pinched against it drags that body through the other.
    """
    for i, j in _movers_beside(scene, numbers):
        mover, still = scene.objects[i], scene.objects[j]
        if still.object_type not in COLLIDERS or _moves(still):
            continue
        way = (mover.shape.outline(shift, turn) for shift, turn in _poses(mover))
        if any(overlap(outline, _outline(still.shape)) for outline in way):
            yield (
                f"{_label(scene, i)}: passes through {_label(scene, j)}; "
                "move one of them, or change kinematics"
            )


@lru_cache(64)
def _outline(shape: Any) -> Outline:
    """Outline of a shape; most are those of the scene that was checked before."""
    outline: Outline = shape.outline()
    return outline


def overlap(one: Outline, other: Outline) -> bool:
    """Whether two outlines have a pixel in common, with its whole neighbourhood."""
    import cv2  # here, because reading a schema should not load it

    a, b = np.concatenate(one), np.concatenate(other)
    low, high = np.maximum(a.min(0), b.min(0)), np.minimum(a.max(0), b.max(0))
    if (low > high).any():
        return False
    start = np.floor(low * RASTER).astype(int) - 2  # pixels beyond hold no overlap
    width, height = np.ceil(high * RASTER).astype(int) + 2 - start
    both = np.full((height, width), 1, np.uint8)
    for outline in (one, other):
        image = np.zeros_like(both)
        paint(image, outline, [1], RASTER, start)
        both &= image
    return bool(cv2.erode(both, np.ones((3, 3), np.uint8)).any())


def _check_balance(scene: Sections, numbers: Sequence[int]) -> Iterator[str]:
    for i in numbers:
        thing = scene.objects[i]
        if (
            thing.object_type != "dynamic_body"
            or thing.physics_properties.constitutive_model != "rigid"
        ):
            continue
        off = centroid(thing.shape.local_outline())
        if np.hypot(*off) > 0.1 * spacing(scene):
            yield (
                f"{_label(scene, i)}: shape has its center of mass at "
                f"[{off[0]:.4f}, {off[1]:.4f}] m from its center, must be centered on "
                "it to be rigid; shift its vertices, or take a symmetric shape"
            )


def _check_belts(scene: Sections, numbers: Sequence[int]) -> Iterator[str]:
    for i in numbers:
        thing = scene.objects[i]
        if thing.object_type != "kinematic_collider":
            continue
        belt = thing.kinematics.type == "conveyor"
        if belt and thing.contact.type != "sticky" and thing.contact.friction == 0.0:
            yield (
                f"{_label(scene, i)}: contact.friction = 0 on a conveyor, must be > 0 "
                "to carry anything; raise it, or take contact.type = 'sticky'"
            )


CHECKS: dict[str, Callable[[Sections, Sequence[int]], Iterator[str]]] = {
    "names": _check_names,
    "particles": _check_particles,
    "jets": _check_jets,
    "output": _check_output,
    "speeds": _check_speeds,
    "tearing": _check_tearing,
    "stability": _check_stability,
    "colors": _check_colors,
    "domain": _check_domain,
    "overlap": _check_overlap,
    "sweeps": _check_sweeps,
    "balance": _check_balance,
    "belts": _check_belts,
}
