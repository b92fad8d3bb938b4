"""Time of the race of candidates, beside running all of them to the end.

    python -m benchmarks.evaluate [--candidates 15] [--samples 3]
    python -m benchmarks.evaluate --sandbox 20

Candidates of a sample are programs of the kind that a model writes: its own scene with
other materials, speeds and places, one of them right. The race runs their prefixes,
stops losers, and goes on to the end with what the prefix chooses. Both are compared in
seconds of a processor, which other jobs of the machine hardly change, and without the
sandbox, which adds little and hides what those that it kills have used. The harness is
what is left of the time of an evaluation when that of the programs is taken away.

The second command tells what the sandbox adds to a run: a program that imports what
programs import and yields a frame, with and without it in turn, so many times each.
"""

import argparse
import statistics
import time
from itertools import pairwise
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage

import numpy as np

from mpmworlds.baselines.candidates import Sample
from mpmworlds.baselines.execution import Runs
from mpmworlds.baselines.protocol import ProgramText
from mpmworlds.builder.plan.manifest import read_manifest, recorded_manifest
from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.metrics.reduction import reduce_clip, split_clip
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene


def main() -> None:
    """Print a line per sample, and medians."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--candidates", type=int, default=15)
    parser.add_argument("--samples", type=int, default=3)
    parser.add_argument("--sandbox", type=int, metavar="RUNS")
    options = parser.parse_args()
    if options.sandbox:
        print(sandbox_line(options.sandbox))
        return
    half = options.candidates // 2
    by_parent: dict[str, list[Scene]] = {}
    for row in read_manifest(recorded_manifest("full")):
        if row.kind == "perturbation" and row.split == "test":
            siblings = by_parent.setdefault(row.parent_id, [])
            siblings.append(Scene.from_yaml(row.scene, row.id))
    pairs = list(pairwise(n for n in sorted(by_parent) if len(by_parent[n]) >= half))
    chosen = pairs[:: max(1, len(pairs) // options.samples)][: options.samples]
    ratios, overheads = [], []
    print("sample       all [s]   race [s]   ratio   harness [%]")
    for one, other in chosen:
        # Half of them are near the truth, the others near another scene.
        scenes = by_parent[other][: options.candidates - half] + by_parent[one][:half]
        ratio, overhead = measure([link(scene) for scene in scenes], scenes[-1], one)
        ratios.append(ratio)
        overheads.append(overhead)
    ratio, overhead = statistics.median(ratios), statistics.median(overheads)
    print(f"medians: ratio {ratio:.2f}, harness {100 * overhead:.1f} %")


SHORT = """import cv2, numpy as np, taichi as ti
ti.init(ti.cpu, cpu_max_num_threads=1)
def frames():
    yield np.zeros((512, 512, 3), np.uint8)
"""


def sandbox_line(runs: int) -> str:
    """Seconds of a short program with and without the sandbox, run in turn."""
    seconds: dict[bool, list[float]] = {True: [], False: []}
    for _ in range(runs):
        for trusted, found in seconds.items():
            outcome = run(SHORT, trusted=trusted)
            outcome.expect()
            found.append(outcome.seconds)
    free, confined = (np.array(seconds[trusted]) for trusted in (True, False))
    return (
        f"{runs} pairs: {np.median(free):.3f} s free, {np.median(confined):.3f} s in "
        f"the sandbox; it adds {1000 * np.median(confined - free):.0f} ms in the "
        f"median, {1000 * (confined.min() - free.min()):.0f} ms to the least"
    )


def measure(programs: list[str], truth: Scene, name: str) -> tuple[float, float]:
    """Ratio of the times of race and full runs; part of the race that is harness."""
    rate = truth.output.framerate
    form = VideoForm(truth.simulation.duration_frames, rate, truth.output.resolution)
    frames = run(link(truth), trusted=True).expect()
    prefix, continuation = split_clip(reduce_clip(frames, rate), 15)
    start = used()
    for text in programs:
        run(text, trusted=True).expect()
    everything = used() - start
    start, begun = used(), time.perf_counter()
    with Runs(form, len(prefix), truth.to_yaml(), sandbox=False) as runs:
        scored = Sample(prefix, continuation, form, runs).scored(
            [ProgramText(text) for text in programs], "prefix"
        )
        overhead = 1.0 - runs.seconds / (time.perf_counter() - begun)
    race = used() - start
    whole = [s.continuation["mask_iou"] for s in scored if s.continuation]
    print(
        f"{name:10s} {everything:9.1f} {race:10.1f} {race / everything:7.2f} "
        f"{100 * overhead:10.1f}   best {max(whole):.2f}, {len(whole)} to the end"
    )
    return race / everything, overhead


def used() -> float:
    """Seconds of a processor, of this process and of all that it has waited for."""
    own, others = map(getrusage, (RUSAGE_SELF, RUSAGE_CHILDREN))
    return own.ru_utime + own.ru_stime + others.ru_utime + others.ru_stime


if __name__ == "__main__":
    main()
