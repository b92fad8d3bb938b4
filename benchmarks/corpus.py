"""Measure what the corpus costs and print a table as Markdown.

    python benchmarks/corpus.py plan          scenes planned per second, without trials
    python benchmarks/corpus.py screen        trials per second
    python benchmarks/corpus.py materialise --manifest FILE    videos per second

Each with one process and with two, in turns; `materialise --ray` also through a Ray
cluster on this machine.
"""

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from importlib.resources import files
from multiprocessing import get_context
from pathlib import Path

import yaml

from mpmworlds.builder.plan.manifest import read_manifest
from mpmworlds.builder.plan.plan import write_plan
from mpmworlds.builder.plan.profile import Batch, Count, Profile
from mpmworlds.builder.plan.screen import try_out
from mpmworlds.builder.render.executors import open_executor
from mpmworlds.builder.render.materialise import materialise
from mpmworlds.builder.render.render import render_row
from mpmworlds.builder.render.store import Store
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.run.warm import WarmStart
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.uniform import uniform

FAMILIES = 12
CORPUS = 95_805
TEMPLATES = 9_204


def plan_rate(workers: int) -> float:
    """Scenes planned per second, most of them perturbations."""
    params = yaml.safe_load(files("mpmworlds").joinpath("params.yaml").read_text())
    profile = replace(
        Profile.from_params(params, "full"),
        seeds=(),
        parents=(Batch(FAMILIES, 35),),
        children=Count(8),
        screen="none",
    )
    with tempfile.TemporaryDirectory() as folder:
        start = time.monotonic()
        done = write_plan(profile, Path(folder) / "m.parquet", workers=workers)
        return len(done.rows) / (time.monotonic() - start)


def trial_rate(workers: int) -> float:
    """Trials of seeds per second."""
    scenes = list(load_seeds().values())
    parts = [scenes[k::workers] for k in range(workers)]
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        start = time.monotonic()
        list(pool.map(_try_all, parts))
        return len(scenes) / (time.monotonic() - start)


def _try_all(scenes: list[Scene]) -> None:
    with WarmStart() as warm:
        for scene in scenes:
            try_out(scene, warm)


def video_rate(manifest: Path, count: int, workers: int, ray: str | None) -> float:
    """Videos of rows drawn at random per second, into an empty store."""
    rows = sorted(read_manifest(manifest), key=lambda row: uniform("bench", "", row.id))
    with tempfile.TemporaryDirectory() as folder:
        store = Store(Path(folder))
        start = time.monotonic()
        with open_executor(render_row, workers, ray) as executor:
            materialise(rows[:count], store, Path(folder) / "failures.jsonl", executor)
        return count / (time.monotonic() - start)


def table(
    what: str, total: int, ways: dict[str, Callable[[], float]], rounds: int
) -> None:
    """Print medians of rounds in which the ways take turns."""
    rates: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(rounds):
        for name, way in ways.items():
            rates[name].append(way())
    print(f"| {what} | per second | {total:,} take |\n|---|---|---|")
    for name, found in rates.items():
        rate = statistics.median(found)
        print(f"| {name} | {rate:.2f} | {total / rate / 3600:.1f} h |")


def main() -> None:
    """Measure what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["plan", "screen", "materialise"])
    parser.add_argument("--manifest", type=Path)
    parser.add_argument("--count", type=int, default=4, help="videos per round")
    parser.add_argument("--ray", action="store_true")
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    if options.what == "plan":
        ways = {f"{n} processes": lambda n=n: plan_rate(n) for n in (1, 2)}
        table("scenes planned", CORPUS, ways, options.rounds)
    elif options.what == "screen":
        ways = {f"{n} processes": lambda n=n: trial_rate(n) for n in (1, 2)}
        table("trials", TEMPLATES, ways, options.rounds)
    else:
        places: dict[str, tuple[int, str | None]] = {
            f"{n} processes": (n, None) for n in (1, 2)
        }
        if options.ray:
            places["Ray, 2 tasks"] = (2, "local")
        ways = {
            name: lambda place=place: video_rate(
                options.manifest, options.count, *place
            )
            for name, place in places.items()
        }
        table("videos", CORPUS, ways, options.rounds)


if __name__ == "__main__":
    main()
