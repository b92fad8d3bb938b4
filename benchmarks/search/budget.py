"""Scores over budgets: what search would have answered with less time.

Whatever a search does next does not depend on how much time is left, so that one run
with the largest budget has in it what each smaller one comes to.
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage
from typing import Any, Final

from benchmarks.search.measure import evaluate_on, read_all, table
from benchmarks.search.rows import FINAL, SPLITS, all_ids, chosen_ids, examples

from mpmworlds.baselines.protocol import Answer, AnyPredictor, Task
from mpmworlds.baselines.registry import predictor_named
from mpmworlds.baselines.results import Result
from mpmworlds.baselines.scoring import task_of
from mpmworlds.baselines.search.infer import Budget, infer
from mpmworlds.baselines.search.predictor import ProgramSearch, answer
from mpmworlds.baselines.search.repair import written
from mpmworlds.baselines.search.side import read_side
from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.text import read_text
from mpmworlds.loaders.load import Example
from mpmworlds.loaders.regimes import DEFAULT, REGIMES

ENDLESS: Final = 1_000_000  # runs


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add which budgets."""
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--regime", default=DEFAULT, choices=sorted(REGIMES))
    parser.add_argument("--split", choices=sorted({*SPLITS, *FINAL}), default=SPLITS[0])
    parser.add_argument(
        "--final",
        action="store_true",
        help="all samples of the split, the test split too: once, at the end",
    )
    parser.add_argument("--minutes", type=float, nargs="+", default=[1, 2, 5])
    parser.add_argument(
        "--part",
        type=part,
        default=(0, 1),
        help="K/N: only each N-th sample from number K on, which counts from 0",
    )


def part(text: str) -> tuple[int, int]:
    """Number and count of a part: K/N, K from 0 to N - 1."""
    place, _, parts = text.partition("/")
    if not (place.isdigit() and parts.isdigit() and int(place) < int(parts)):
        raise argparse.ArgumentTypeError(
            f"{text}: must be K/N with K from 0 to N - 1, so 0/2 and 1/2 for two halves"
        )
    return int(place), int(parts)


def carry_out(options: argparse.Namespace) -> None:
    """Search once a sample, evaluate at each budget, and print the tables."""
    place, parts = options.part
    rows = options.release, options.split, options.config
    ids = (all_ids if options.final else chosen_ids)(*rows)[place::parts]
    chosen = examples(*rows, ids, options.regime, final=options.final)
    scenes = options.out / "scenes"
    for example in chosen:
        _search(example, options, scenes)
    copied = _evaluated(options, chosen, predictor_named("copy_last", {}), {}, "copied")
    for minutes in options.minutes:
        told = {"minutes": minutes, "runs": ENDLESS, "candidates": 1}
        recorded = _Recorded(scenes, minutes)
        found = _evaluated(options, chosen, recorded, told, f"{minutes:g}")
        print(f"\n{minutes:g} minutes")
        print("\n".join(table(found, copied)))


def _evaluated(
    options: argparse.Namespace,
    chosen: Sequence[Example],
    predictor: AnyPredictor,
    told: Mapping[str, Any],
    name: str,
) -> dict[str, Result]:
    """Results of a predictor on the samples, as `mpmworlds evaluate` writes them."""
    folder = options.out / name / options.split
    evaluate_on(options, options.split, chosen, predictor, told, folder)
    return read_all(folder.parent, [options.split])


def _search(example: Example, options: argparse.Namespace, folder: Path) -> None:
    """Write the best scene at each budget, unless all are there."""
    if all(_path(folder, example.id, m).is_file() for m in options.minutes):
        return
    task, most, before = task_of(example), max(options.minutes), _cpu_seconds()
    found = infer(
        task.prefix,
        task.framerate,
        task.form,
        read_side(task.side_info),
        Budget(ENDLESS, most),
        1,
    )
    every = found.search.answers
    for minutes in options.minutes:
        trials = [t for t in every if t.spent <= 60.0 * minutes]
        best = min(trials or every[:1], key=lambda t: t.loss)
        write_atomically(
            _path(folder, example.id, minutes), written(best.data).encode()
        )
    print(
        f"{example.id}: {_cpu_seconds() - before:.0f} s of a core, "
        f"{found.search.best.spent:.0f} s by the estimate until the best scene, whose "
        f"loss is {found.search.best.loss:.4f}",
        flush=True,
    )


def _cpu_seconds() -> float:
    """Of this process and those that it has waited for."""
    return sum(
        usage.ru_utime + usage.ru_stime
        for usage in map(getrusage, (RUSAGE_SELF, RUSAGE_CHILDREN))
    )


def _path(folder: Path, sample: str, minutes: float) -> Path:
    return folder / f"{minutes:g}" / f"{sample}.yaml"


class _Recorded:
    """Answers with scenes that were found before."""

    name = ProgramSearch.name

    def __init__(self, scenes: Path, minutes: float) -> None:
        self.scenes, self.minutes = scenes, minutes

    def look_up(self, sample_id: str, task: Task) -> Sequence[Answer]:
        """What the scene of a sample draws."""
        return [answer(task, read_text(_path(self.scenes, sample_id, self.minutes)))]
