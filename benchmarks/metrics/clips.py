"""Clips to study metrics on: samples at full quality, and each run displaced."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mpmworlds.builder.plan.manifest import read_manifest, recorded_manifest
from mpmworlds.builder.render.executors import carry_out_all, open_executor
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.scratch import Scratch
from mpmworlds.metrics.clips import Clip
from mpmworlds.metrics.reduction import reduce_clip, reduced_framerate, split_clip
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.displace import displaced
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.recorded_lists import RECORDED


class Pair(NamedTuple):
    """The continuation of a sample, and that of a run displaced by a hair."""

    name: str
    truth: Clip
    again: Clip


class Task(NamedTuple):
    """A sample to render."""

    name: str
    scene: str


def render(task: Task) -> tuple[Clip, Clip]:
    """Run a scene twice, as it is and displaced, and reduce both."""
    scene = Scene.from_yaml(task.scene, task.name)
    program, rate = link(scene), scene.output.framerate
    texts = program, displaced(program, 0)
    one, other = (run(text, trusted=True).expect() for text in texts)
    return reduce_clip(one, rate), reduce_clip(other, rate)


def scenes(which: str) -> list[Task]:
    """Scenes of a list of the full corpus such as `mini_train`, or the seeds."""
    if which == "seeds":
        named = load_seeds().items()
        return [Task(name, scene.to_yaml()) for name, scene in named]
    text = RECORDED.joinpath("full", f"{which}.txt").read_text("utf-8")
    wanted = set(text.split())
    rows = read_manifest(recorded_manifest("full"))
    return [Task(row.id, row.scene) for row in rows if row.id in wanted]


def make(which: str, folder: Path, count: int | None, workers: int) -> None:
    """Render what is not there yet."""
    folder.mkdir(parents=True, exist_ok=True)
    tasks = scenes(which)[:count]
    left = [task for task in tasks if not (folder / f"{task.name}.npz").exists()]
    with open_executor(render, workers, None) as executor, Scratch() as scratch:
        for task, (truth, again) in carry_out_all(executor, left, lambda t: t.name):
            path = scratch.path / "clip.npz"
            np.savez_compressed(path, truth=truth, again=again)
            write_atomically(folder / f"{task.name}.npz", path.read_bytes())
            sys.stderr.write(f"{task.name}\n")


def read(folder: Path) -> Iterator[Pair]:
    """Continuations of what `make` rendered."""
    for path in sorted(folder.glob("*.npz")):
        with np.load(path) as both:
            rate = reduced_framerate(30)
            truth, again = (split_clip(both[k], rate)[1] for k in ("truth", "again"))
        yield Pair(path.stem, truth, again)
