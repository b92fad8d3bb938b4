"""Runs of the prefix: each scene once, within a budget counted alike everywhere."""

import copy
import json
import math
from collections.abc import Callable
from typing import Any, Final

from mpmworlds.baselines.search.perception.colors import Labels
from mpmworlds.baselines.search.repair import unchecked
from mpmworlds.baselines.search.trials.loss import Losses, Reference
from mpmworlds.files.closeable import Closeable
from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.metrics.reduction import FRAMERATE, reduce_clip
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.laboratory import Laboratory
from mpmworlds.sim.run.lifted import Lifted, lifted, room_for
from mpmworlds.sim.scene.fields import polygon_area
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.sim.scene.steps import spacing

Data = dict[str, Any]

TIMEOUT: Final = 240.0  # seconds of one run, which only a fault takes
LOST: Final = Losses(2.0, {})  # loss of a scene that cannot be run
# Estimated seconds of a run on one core: what reading and comparing frames takes, what
# compiling takes where nothing like it was run before, a step, and moves of particles.
FRAMES: Final = 0.1
COMPILING: Final = 0.7
STEP: Final = 2.2e-4
MOVES_PER_SECOND: Final = 1.2e7


class BudgetSpent(Exception):
    """No run is left."""


class Lab(Closeable):
    """Draws prefixes of scenes and compares them with the one that is seen.

    Time is estimated from the work, not measured: the same scenes are tried on a slow
    machine and on a fast one.

    Parameters
    ----------
    labels
        The prefix.
    form
        Of the whole video.
    runs, seconds
        Budget: number of runs, and estimated seconds on one core.
    told
        Called after each run with the share of the budget that is spent.
    """

    def __init__(
        self,
        labels: Labels,
        form: VideoForm,
        runs: int,
        seconds: float,
        told: Callable[[float], None] | None = None,
    ) -> None:
        self._reference = Reference(labels)
        self._form, self._count = form, len(labels.numbers)
        self._runs, self._seconds, self._told = runs, seconds, told
        self._laboratory = Laboratory()
        self._cache: dict[str, Losses] = {}
        self._compiled: set[tuple[str, int]] = set()
        self.runs = 0
        """Runs so far."""
        self.seconds = 0.0
        """Estimated seconds so far."""

    @property
    def frames(self) -> int:
        """Frames of the prefix."""
        return self._count

    @property
    def left(self) -> float:
        """Share of the budget that is left."""
        return max(
            0.0, min(1.0 - self.runs / self._runs, 1.0 - self.seconds / self._seconds)
        )

    def loss(self, data: Data, frames: int | None = None) -> float:
        """Loss of a scene in plain data, see `losses`."""
        return self.losses(data, frames).whole

    def losses(self, data: Data, frames: int | None = None) -> Losses:
        """Losses of a scene in plain data on the first frames, all if None.

        Raises
        ------
        BudgetSpent
            If it is not known and there is no run left.
        """
        count = min(frames or self._count, self._count)
        key = f"{count}:{json.dumps(data, sort_keys=True)}"
        if key not in self._cache:
            if self.left <= 0.0:
                raise BudgetSpent
            self._cache[key] = self._tried(data, count)
            if self._told is not None:
                self._told(1.0 - self.left)
        return self._cache[key]

    def _tried(self, data: Data, count: int) -> Losses:
        full = self._form.framerate
        rate = FRAMERATE if full % FRAMERATE == 0 else full
        drawn = count if rate <= FRAMERATE else (count - 1) * full // FRAMERATE + 1
        try:
            scene = unchecked(_sparse(data, drawn, full // rate, rate))
            program = lifted(link(scene))
        except ValueError:
            return LOST
        self.runs += 1
        self.seconds += self._cost(scene, program)
        outcome = self._laboratory.run(program.text, drawn, TIMEOUT)
        if outcome.status != "ok":
            return LOST
        return self._reference.losses(reduce_clip(outcome.frames, rate))

    def _cost(self, scene: Scene, program: Lifted) -> float:
        """Estimated seconds of a run."""
        steps = scene.simulation.duration_frames * scene.simulation.substeps_per_frame
        count = _particles(scene)
        kind = program.kernels, room_for(count)
        known = kind in self._compiled
        self._compiled.add(kind)
        start = FRAMES if known else FRAMES + COMPILING
        return start + steps * (STEP + count / MOVES_PER_SECOND)

    def close(self) -> None:
        """End the process that runs scenes."""
        self._laboratory.close()


def _sparse(data: Data, count: int, skipped: int, rate: int) -> Data:
    """The scene, drawn only where the prefix has frames."""
    data = copy.copy(data)
    simulation = data["simulation"]
    data["simulation"] = simulation | {
        "duration_frames": count,
        "substeps_per_frame": simulation["substeps_per_frame"] * skipped,
    }
    data["output"] = data["output"] | {"framerate": rate}
    return data


def _particles(scene: Scene) -> int:
    """About how many particles there are on the way, those that are born half of it."""
    area = spacing(scene) ** 2
    particles = 0.0
    end = scene.simulation.duration_frames * scene.simulation.substeps_per_frame
    time = end * scene.simulation.time_step_dt
    for thing in scene.objects:
        if thing.object_type == "dynamic_body":
            particles += sum(map(polygon_area, thing.shape.local_outline())) / area
        elif thing.object_type == "emitter":
            lasting = max(min(time, thing.emission.stop) - thing.emission.start, 0.0)
            particles += 0.5 * thing.emission.rate * lasting
    return math.ceil(particles)
