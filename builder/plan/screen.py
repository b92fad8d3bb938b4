"""The screen: a short, cheap run of a template, and what it must show.

A trial runs the linked program at `CELLS` cells a side through the 2.5 s of prefix and
a while beyond, without pictures. Where that does not tell what the scene itself does,
it runs once more at full size. Its `Findings` are numbers; `fault` judges them.
"""

import math
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from mpmworlds.builder.plan import measures
from mpmworlds.metrics.reduction import PREFIX_SECONDS
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import Outcome
from mpmworlds.sim.run.states import States
from mpmworlds.sim.run.warm import WarmStart
from mpmworlds.sim.scene.scale import rescale
from mpmworlds.sim.scene.scene import Scene, SceneError
from mpmworlds.sim.scene.steps import speed_of

CELLS: Final = 64  # the six cells of the seeds' walls are then three, the least
PIXELS: Final = 32
BEYOND: Final = 1.5  # and how far the trial goes on after it [s]
TIMEOUT: Final = 120.0  # seconds
ATTEMPTS: Final = 3  # of a trial that crashes or takes too long
LEAST_MATTER: Final = 16  # particles that must be there at the end of the prefix
LEAST: Final = {
    "travel": 0.02,  # how far matter must get during the prefix [m]
    "later": 0.004,  # and in half a second after it: half a cell of 128 [m]
    "motion": 0.05,  # part of the foreground that must change in a second
}
MOST: Final = {
    "speed": 1.0,  # part of the speed that all causes of motion explain
    "depth": 1.0,  # of a particle in a solid [cells]
    "inverted": 0.01,  # of a mesh
    "crowded": 0.05,  # of the matter
}
REASONS: Final = {  # in words, of what is too little or too much
    "speed": "exploding",
    "depth": "tunnels",
    "inverted": "inverted",
    "crowded": "crowded",
    "travel": "static",
    "later": "at_rest_after_prefix",
    "motion": "hardly_moves",
}

# When a trial at full size decides. Of 200 templates drawn at random 16 had another
# verdict at full size than at 64 cells; none of the 73 % that these rules leave.
UNLIKE: Final = frozenset({"elastic_fem", "wet_sand"})  # another outcome on other grids
NEAR: Final = 2.0  # factor on a least motion within which a trial is in doubt
NEARLY: Final = {  # parts of greatest values within which it is in doubt
    "speed": (0.75, 1.5),
    "depth": (0.6, 2.0),
    "crowded": (0.4, 4.0),
}


@dataclass(frozen=True)
class Findings:
    """What a trial showed.

    Attributes
    ----------
    status
        How the run ended, "ok" or a kind of failure, see `sim.run.run.Status`.
    cells
        Cells a side of the run.
    matter
        Particles at the end of the prefix, and rigid bodies as `LEAST_MATTER` each.
    lost
        Particles and rigid bodies that became infinite or left the domain.
    travel, later
        Displacement that a tenth of the matter exceeds: over the prefix, and over half
        a second after it [m].
    motion
        Part of the foreground that changes in a second after the prefix, see
        `measures.motion`.
    speed
        Largest speed over that which gravity and all prescribed motions explain.
    depth
        Deepest particle in a solid [cells].
    inverted, crowded
        Part of a mesh that is inside out, and of matter in overfull cells.
    """

    status: str
    cells: int = CELLS
    matter: int = 0
    lost: int = 0
    travel: float = 0.0
    later: float = 0.0
    motion: float = 0.0
    speed: float = 0.0
    depth: float = 0.0
    inverted: float = 0.0
    crowded: float = 0.0


def try_out(scene: Scene, warm: WarmStart) -> Findings:
    """Run a scene shortly, at full size if a small run leaves a doubt.

    Parameters
    ----------
    scene
        The scene as it is planned.
    warm
        Where its program is forked from.

    Returns
    -------
    Findings
        What decides.

    Raises
    ------
    RuntimeError
        If it takes too long again and again. That says nothing about the scene.
    """
    cells = scene.simulation.grid_resolution
    if cells > CELLS and not scene.materials & UNLIKE:
        with suppress(SceneError):  # if there is no such scene at `CELLS` cells
            found = _run(scene, CELLS, warm)
            if not in_doubt(found):
                return found
    return _run(scene, cells, warm)


def in_doubt(found: Findings) -> bool:
    """Whether a trial at `CELLS` cells does not tell what a scene does at full size.

    Parameters
    ----------
    found
        What the small trial of it showed.
    """
    if found.status != "ok":
        return False
    for name, least in LEAST.items():
        if least / NEAR <= getattr(found, name) <= least * NEAR:
            return True
    return any(
        low * MOST[name] <= getattr(found, name) <= high * MOST[name]
        for name, (low, high) in NEARLY.items()
    )


def _run(scene: Scene, cells: int, warm: WarmStart) -> Findings:
    """Run a scene at so many cells a side."""
    frames = round((PREFIX_SECONDS + BEYOND) * scene.output.framerate) + 1
    small = rescale(scene, cells, PIXELS, frames)
    program = link(small)
    for _ in range(ATTEMPTS):  # the machine may be at fault: it lacks time or memory
        outcome = warm.run(program, frames, TIMEOUT, pictures=False)
        if outcome.status not in ("crash", "killed", "timeout"):
            break
    if outcome.status == "timeout":
        raise RuntimeError(
            f"a trial of {PREFIX_SECONDS + BEYOND:g} s did not end within "
            f"{TIMEOUT:g} s, {ATTEMPTS} times; run the command again when the machine "
            "is less busy, or with fewer --workers, what is finished is kept"
        )
    return findings(small, outcome)


def findings(scene: Scene, outcome: Outcome) -> Findings:
    """What a run of a scene shows."""
    if outcome.status != "ok" or outcome.states is None:
        return Findings(outcome.status, scene.simulation.grid_resolution)
    return measured(scene, States.of(scene, outcome.states))


def measured(scene: Scene, states: States) -> Findings:
    """What the states of a scene show."""
    rate = scene.output.framerate
    prefix, soon = round(PREFIX_SECONDS * rate), round((PREFIX_SECONDS + 0.5) * rate)
    bodies = sum(math.isfinite(m) for m in states.solid_mass)
    views = measures.views(scene, states, prefix)
    return Findings(
        "ok",
        scene.simulation.grid_resolution,
        matter=int(states.born[prefix].sum()) + LEAST_MATTER * bodies,
        lost=measures.lost(states),
        travel=_rounded(measures.travel(states, 0, prefix)),
        later=_rounded(measures.travel(states, prefix, soon)),
        motion=_rounded(measures.motion(views, rate)),
        speed=_rounded(measures.top_speed(states) / fastest_explained(scene)),
        depth=_rounded(measures.depth(scene, states)),
        inverted=_rounded(measures.inverted(scene, states)),
        crowded=_rounded(measures.crowded(scene, states)),
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
    if found.lost > 0:
        return "not_finite_or_outside"
    if found.matter < LEAST_MATTER:
        return "blank"
    for name, reason in REASONS.items():
        value = getattr(found, name)
        if not LEAST.get(name, -math.inf) <= value <= MOST.get(name, math.inf):
            return reason  # so is what is NaN
    return None


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


def _rounded(value: float) -> float:
    """Four significant digits: enough to judge, and short to record."""
    return float(f"{value:.4g}")
