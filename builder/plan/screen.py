"""The screen: a short, cheap run of a template, and what it must show.

A trial runs the linked program at `CELLS` cells a side through the 2.5 s of prefix and
a while beyond, without pictures. Its `Findings` are numbers; `fault` judges them.
"""

import math
from dataclasses import dataclass
from typing import Final

from mpmworlds.builder.plan import measures
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import Outcome
from mpmworlds.sim.run.states import States
from mpmworlds.sim.run.warm import WarmStart
from mpmworlds.sim.scene.scale import rescale
from mpmworlds.sim.scene.scene import Scene, SceneError
from mpmworlds.sim.scene.steps import speed_of

CELLS: Final = 64  # the six cells of the seeds' walls are then three, the least
PIXELS: Final = 32
PREFIX: Final = 2.5  # seconds of video that a model is shown
BEYOND: Final = 1.5  # and how far the trial goes on after it [s]
TIMEOUT: Final = 120.0  # seconds
ATTEMPTS: Final = 3  # of a trial that crashes or takes too long
LEAST_MATTER: Final = 16  # particles that must be there at the end of the prefix
LEAST_TRAVEL: Final = 0.02  # how far matter must get during the prefix [m]
LEAST_LATER: Final = 0.004  # and in half a second after it: half a cell of 128 [m]
LEAST_MOTION: Final = 0.05  # part of the foreground that must change in a second
MOST_DEPTH: Final = 1.0  # of a particle in a solid [cells]
MOST_SPEED: Final = 1.0  # part of the speed that all causes of motion explain
MOST_INVERTED: Final = 0.01  # of a mesh
MOST_CROWDED: Final = 0.05  # of the matter


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
    rate = scene.output.framerate
    prefix, soon = round(PREFIX * rate), round((PREFIX + 0.5) * rate)
    bodies = sum(math.isfinite(m) for m in states.solid_mass)
    views = measures.views(scene, states, prefix)
    return Findings(
        "ok",
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
    rules = {
        "not_finite_or_outside": found.lost > 0,
        "blank": found.matter < LEAST_MATTER,
        "exploding": found.speed > MOST_SPEED,
        "tunnels": found.depth > MOST_DEPTH,
        "inverted": found.inverted > MOST_INVERTED,
        "crowded": found.crowded > MOST_CROWDED,
        "static": found.travel < LEAST_TRAVEL,
        "at_rest_after_prefix": found.later < LEAST_LATER,
        "hardly_moves": found.motion < LEAST_MOTION,
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


def _rounded(value: float) -> float:
    """Four significant digits: enough to judge, and short to record."""
    return float(f"{value:.4g}")
