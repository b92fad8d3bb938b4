"""What the states of a run show: how far matter gets, how fast, and what is wrong.

All are numbers; `screen` judges them.
"""

import math

import numpy as np
import numpy.typing as npt

from mpmworlds.sim.run.states import States
from mpmworlds.sim.scene.outlines import Outline, paint
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.sim.scene.steps import spacing

STRIDE = 15  # frames between those that are looked at, where not all are
RASTER = 512  # pixels a side for depths
VIEW = 64  # pixels a side at which changes of the picture are seen
BACK = 1.0  # s of video over which a change is measured
CROWD = 3.0  # times the particles of matter at rest, in a cell

Floats = npt.NDArray[np.float64]
Labels = npt.NDArray[np.integer]
Mask = npt.NDArray[np.bool_]


def inside(states: States) -> Mask:
    """Which particles are in the domain, (T, N); one that is NaN is not.

    A program clamps places into the domain, NaN to a corner: velocities tell it.
    """
    x, finite = states.positions, np.isfinite(states.velocities)
    return np.asarray(((x > 0.0) & (x < 1.0) & finite).all(axis=2))


def lost(states: States) -> int:
    """Particles and rigid bodies that became infinite or left the domain."""
    bodies = np.isfinite(states.solid_mass)
    centers = states.poses[:, bodies, :2]
    astray = ~((centers > 0.0) & (centers < 1.0)).all(axis=(0, 2))
    return int((states.born & ~inside(states)).any(axis=0).sum() + astray.sum())


def top_speed(states: States) -> float:
    """Largest speed of a particle [m/s]."""
    there = states.born & inside(states)
    speeds = np.linalg.norm(states.velocities[there], axis=-1)
    return float(speeds.max(initial=0.0))


def travel(states: States, start: int, stop: int) -> float:
    """Displacement that a tenth of the matter exceeds between two frames [m].

    What is born in between counts from the first frame of its life.
    """
    first = np.argmax(states.born, axis=0).clip(start)
    there = states.born[stop]
    numbers = np.arange(len(there))
    before, after = states.positions[first.clip(None, stop), numbers], states.positions
    ways = np.linalg.norm(after[stop] - before, axis=1)[there]
    rigid = np.isfinite(states.solid_mass)
    moved = states.poses[stop, rigid, :2] - states.poses[start, rigid, :2]
    parts = [
        np.quantile(w, 0.9) for w in (ways, np.linalg.norm(moved, axis=1)) if len(w)
    ]
    return float(np.max(parts, initial=0.0))


def depth(scene: Scene, states: States) -> float:
    """Deepest particle in a solid at any of some frames [cells]."""
    deepest, within = 0.0, states.born & inside(states)
    for n in range(len(states.solid_id)):
        for t in range(0, len(states.time), STRIDE):
            outline = _outline(scene, states, t, n)
            if outline:
                column, row = (states.positions[t][within[t]] * RASTER).astype(int).T
                found = _depth_map(outline)[row, column]
                deepest = max(deepest, float(found.max(initial=0.0)))
    return deepest * scene.simulation.grid_resolution


def inverted(scene: Scene, states: States) -> float:
    """Largest part of a mesh that is inside out at any of some frames.

    Of each square of the lattice that the vertices stand on at first, the triangle of
    three corners is looked at.
    """
    most = 0.0
    for i, thing in enumerate(scene.objects):
        properties = getattr(thing, "physics_properties", None)
        if properties is None or properties.constitutive_model != "elastic_fem":
            continue
        x = states.positions[::STRIDE, states.object_id == i].astype(np.float64)
        corner, right, up = _triangles(x[0], spacing(scene))
        if not corner.size:
            continue
        one, other = x[:, right] - x[:, corner], x[:, up] - x[:, corner]
        areas = one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]
        turned = (areas <= 0.0).mean(axis=1)
        most = max(most, float(turned.max(initial=0.0)))
    return most


def crowded(scene: Scene, states: States) -> float:
    """Largest part of the matter in cells that are overfull, at any of some frames.

    That is what pinching does, and emitting into matter. What may be compacted does
    not count.
    """
    cells, most = scene.simulation.grid_resolution, 0.0
    limit = CROWD * scene.simulation.particles_per_cell
    firm = [
        hasattr(thing, "physics_properties") and not thing.physics_properties.COMPACTS
        for thing in scene.objects
    ]
    within = states.born & inside(states) & np.array(firm)[states.object_id]
    for t in range(0, len(states.time), STRIDE):
        column, row = (states.positions[t][within[t]] * cells).astype(int).T
        count = np.bincount(row * cells + column)
        total = max(int(count.sum()), 1)
        most = max(most, float(count[count > limit].sum() / total))
    return most


def motion(labels: Labels, framerate: int) -> float:
    """Median part of the foreground that changes in a second.

    Parameters
    ----------
    labels
        Pictures (T, H, W) of one kind of thing each, 0 for the background, `STRIDE`
        frames apart; the first is the last that a model is shown.
    framerate
        Frames per second.

    Returns
    -------
    float
        Pixels that differ from those `BACK` seconds before, over those that are
        foreground in one of both; the median over all such pairs, so that through half
        of the time it is at least this. 0 if there is no pair.
    """
    lag = round(BACK * framerate / STRIDE)
    before, after = labels[:-lag], labels[lag:]
    changed = np.count_nonzero(before != after, axis=(1, 2))
    there = np.count_nonzero((before != 0) | (after != 0), axis=(1, 2))
    return float(np.median(changed / np.maximum(there, 1))) if len(after) else 0.0


def views(scene: Scene, states: States, start: int) -> Labels:
    """Where the objects are, as `motion` takes it, from a frame on."""
    frames = range(start, len(states.time), STRIDE)
    found = np.zeros((len(frames), VIEW, VIEW), np.uint8)
    within = states.born & inside(states)
    for picture, t in zip(found, frames, strict=True):
        column, row = (states.positions[t][within[t]] * VIEW).astype(int).T
        picture[row, column] = states.object_id[within[t]] + 1
        for n, index in enumerate(states.solid_id):
            paint(picture, _outline(scene, states, t, n), [int(index) + 1], VIEW)
    return found


def _outline(scene: Scene, states: States, t: int, n: int) -> Outline:
    """Outline of a solid at a frame; none if it is nowhere."""
    x, y, angle = states.poses[t, n].tolist()
    if not math.isfinite(x + y + angle):
        return []
    shape = scene.objects[states.solid_id[n]].shape
    shift = x - shape.center[0], y - shape.center[1]
    found: Outline = shape.outline(shift, angle - shape.angle())
    return found


def _depth_map(outline: Outline) -> npt.NDArray[np.float32]:
    """Depth [m] in polygons at the pixels of the domain, 0 outside."""
    import cv2

    mask = np.zeros((RASTER, RASTER), np.uint8)
    paint(mask, outline, [1], RASTER)
    depths = cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.asarray(depths / RASTER, np.float32)


def _triangles(x: Floats, step: float) -> tuple[Labels, Labels, Labels]:
    """Vertices with a neighbour to the right and one above, and those, by number."""
    side = round(1.0 / step)
    column, row = np.rint(x / step - 0.5).astype(int).clip(0, side - 1).T
    number = np.full((side + 1, side + 1), -1)
    number[row, column] = np.arange(len(x))
    corner, right, up = number[:-1, :-1], number[:-1, 1:], number[1:, :-1]
    whole = (corner >= 0) & (right >= 0) & (up >= 0)
    return corner[whole], right[whole], up[whole]
