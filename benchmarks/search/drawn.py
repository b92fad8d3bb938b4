"""What the scenes of results draw, beside the truth."""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from benchmarks.search.rows import SPLITS, examples

from mpmworlds.baselines.results import SCENES
from mpmworlds.files.text import read_text
from mpmworlds.loaders.load import Example
from mpmworlds.metrics.reduction import Frames, reduce_clip
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene


@dataclass(frozen=True)
class Pair:
    """A sample and the scene that was found of it."""

    example: Example
    scene: Scene

    def frames(self) -> Frames:
        """What the scene draws, as it is evaluated: prefix and continuation."""
        drawn = run(link(self.scene), trusted=True).expect()
        return reduce_clip(drawn, self.scene.output.framerate)


def add_results(parser: argparse.ArgumentParser) -> None:
    """Add which results are looked at."""
    parser.add_argument(
        "results", type=Path, nargs="+", help="folders of evaluations, with scenes"
    )


def pairs(options: argparse.Namespace) -> Iterator[Pair]:
    """Samples of development that results have scenes of.

    Raises
    ------
    ValueError
        If there is none.
    """
    found = False
    for folder in options.results:
        there = {path.stem: path for path in sorted((folder / SCENES).glob("*.yaml"))}
        for split in SPLITS:
            for example in examples(options.release, split, options.config, []):
                if example.id in there:
                    found = True
                    path = there[example.id]
                    yield Pair(example, Scene.from_yaml(read_text(path), str(path)))
    if not found:
        raise ValueError(
            f"{', '.join(map(str, options.results))}: no scene of a sample of "
            f"{' or '.join(SPLITS)}; give folders that `mpmworlds evaluate` wrote"
        )
