"""The screen: a short, cheap run of a template, and what it must show.

A trial runs the linked program at `CELLS` cells a side through the 2.5 s of prefix and
half a second beyond, without pictures. Its `Findings` are numbers; `fault` judges them.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import Outcome
from mpmworlds.sim.run.states import States
from mpmworlds.sim.run.warm import WarmStart
from mpmworlds.sim.scene.outlines import paint
from mpmworlds.sim.scene.scale import rescale
from mpmworlds.sim.scene.scene import Scene, SceneError
from mpmworlds.sim.scene.steps import speed_of

CELLS: Final = 64  # the six cells of the seeds' walls are then three, the least
PIXELS: Final = 32
PREFIX: Final = 2.5  # seconds of video that a model is shown
BEYOND: Final = 0.5  # and how far the trial goes on after it [s]
TIMEOUT: Final = 120.0  # seconds
ATTEMPTS: Final = 3  # of a trial that crashes or takes too long
STRIDE: Final = 15  # frames between those at which depths are measured
RASTER: Final = 512  # pixels a side for depths
LEAST_MATTER: Final = 16  # particles that must be there at the end of the prefix
LEAST_TRAVEL: Final = 0.02  # how far matter must get during the prefix [m]
LEAST_LATER: Final = 0.004  # and after it: half a cell of 128 [m]
MOST_DEPTH: Final = 1.0  # of a particle in a solid [cells]
MOST_SPEED: Final = 1.0  # part of the speed that all causes of motion explain

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Findings:
    """What a trial showed.

    Attributes
    ----------
    status
        How the run ended, "ok" or a kind of failure, see `sim.run.run.Status`.
    matter
        Particles at the end of the prefix, and rigid bodies as `LEAST_MATTER` each.
    lost
        Particles and rigid bodies that became infinite or left the domain.
    travel, later
        Displacement that a tenth of the matter exceeds: over the prefix, and over the
        rest of the trial [m].
    speed
        Largest speed over that which gravity and all prescribed motions explain.
    depth
        Deepest particle in a solid [cells].
    """

    status: str
    matter: int = 0
    lost: int = 0
    travel: float = 0.0
    later: float = 0.0
    speed: float = 0.0
    depth: float = 0.0


def try_out(scene: Scene, warm: WarmStart) -> Findings:
    """Run a scene shortly.

    Parameters
    ----------
    scene
        The scene as it is planned.
    warm
        Where its program is forked from.

    Returns
    -------
    Findings
        Also of a scene that is no valid one at `CELLS` cells: status "too_small".

    Raises
    ------
    RuntimeError
        If it takes too long again and again. That says nothing about the scene.
    """
    frames = round((PREFIX + BEYOND) * scene.output.framerate) + 1
    try:
        small = rescale(scene, CELLS, PIXELS, frames)
    except SceneError:
        return Findings("too_small")
    program = link(small)
    for _ in range(ATTEMPTS):  # the machine may be at fault: it lacks time or memory
        outcome = warm.run(program, frames, TIMEOUT, pictures=False)
        if outcome.status not in ("crash", "timeout"):
            break
    if outcome.status == "timeout":
        raise RuntimeError(
            f"a trial of three seconds did not end within {TIMEOUT:g} s, {ATTEMPTS} "
            "times; run the command again when the machine is less busy, or with fewer "
            "--workers, what is finished is kept"
        )
    return findings(small, outcome)


def findings(scene: Scene, outcome: Outcome) -> Findings:
    """What a run of a scene shows."""
    if outcome.status != "ok" or outcome.states is None:
        return Findings(outcome.status)
    return measured(scene, States.of(scene, outcome.states))


def measured(scene: Scene, states: States) -> Findings:
    """What the states of a scene show."""
    born, x = states.born, states.positions
    inside = np.asarray(((x > 0.0) & (x < 1.0)).all(axis=2))  # which no NaN is
    prefix = round(PREFIX * scene.output.framerate)
    bodies = np.isfinite(states.solid_mass)
    centers = states.poses[:, bodies, :2]
    astray = ~((centers > 0.0) & (centers < 1.0)).all(axis=(0, 2))
    speeds = np.linalg.norm(states.velocities[born & inside], axis=-1)
    return Findings(
        "ok",
        matter=int(born[prefix].sum()) + LEAST_MATTER * int(bodies.sum()),
        lost=int((born & ~inside).any(axis=0).sum() + astray.sum()),
        travel=_travel(states, 0, prefix),
        later=_travel(states, prefix, len(states.time) - 1),
        speed=_rounded(speeds.max(initial=0.0) / fastest_explained(scene)),
        depth=_rounded(_depth(scene, states, inside)),
    )


def fault(found: Findings) -> str | None:
    """Say why a scene is rejected; None if it is not.

    Parameters
    ----------
    found
        Findings of its trial.
    """
    if found.status != "ok":
        return found.status
    rules = {
        "not_finite_or_outside": found.lost > 0,
        "blank": found.matter < LEAST_MATTER,
        "exploding": found.speed > MOST_SPEED,
        "tunnels": found.depth > MOST_DEPTH,
        "static": found.travel < LEAST_TRAVEL,
        "at_rest_after_prefix": found.later < LEAST_LATER,
    }
    return next((reason for reason, holds in rules.items() if holds), None)


def fastest_explained(scene: Scene) -> float:
    """Speed [m/s] that nothing should exceed: half more than all causes together.

    What falls gains sqrt(2 g h) at most; what is pushed or sprayed adds the speed of
    that; elastic energy comes from those. The half is for jets between bodies that
    meet, where matter is thrown ahead of what hits it. Liquids that fill a corner make
    thin jets of up to 2.6 times the causes at 128 cells, whatever the time step.
    """
    fall = math.sqrt(2.0 * math.hypot(*scene.environment.gravity))
    most = 3.0 if "liquid" in scene.materials else 1.5
    return most * (fall + sum(map(speed_of, scene.objects)))


def _travel(states: States, start: int, stop: int) -> float:
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
    return _rounded(float(np.max(parts, initial=0.0)))


def _depth(scene: Scene, states: States, inside: npt.NDArray[np.bool_]) -> float:
    """Deepest particle in a solid at any of some frames [cells]."""
    deepest = 0.0
    for n, index in enumerate(states.solid_id):
        shape = scene.objects[index].shape
        for t in range(0, len(states.time), STRIDE):
            x, y, angle = states.poses[t, n].tolist()
            if not math.isfinite(x + y + angle):
                continue
            shift = x - shape.center[0], y - shape.center[1]
            depths = _depth_map(shape.outline(shift, angle - shape.angle()))
            points = states.positions[t][states.born[t] & inside[t]]
            column, row = (points * RASTER).astype(int).T
            deepest = max(deepest, float(depths[row, column].max(initial=0.0)))
    return deepest * scene.simulation.grid_resolution


def _depth_map(outline: list[Floats]) -> npt.NDArray[np.float32]:
    """Depth [m] in polygons at the pixels of the domain, 0 outside."""
    import cv2

    mask = np.zeros((RASTER, RASTER), np.uint8)
    paint(mask, outline, [1], RASTER)
    depths = cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.asarray(depths / RASTER, np.float32)


def _rounded(value: float) -> float:
    """Four significant digits: enough to judge, and short to record."""
    return float(f"{value:.4g}")
