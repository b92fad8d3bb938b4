"""Samples worth evaluating on: those that move on, and are not mere chaos.

The samples that a list would take are run in full, in the order in which it would take
them, until it has as many as it wants. Which were passed over is recorded; with that, a
list is a pure function of ids again.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from importlib.resources import files
from pathlib import Path
from typing import Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from tqdm import tqdm  # type: ignore[import-untyped]

from mpmworlds.builder.plan.manifest import ManifestRow
from mpmworlds.builder.plan.measures import STRIDE, motion
from mpmworlds.builder.plan.screen import LEAST
from mpmworlds.builder.render.executors import carry_out_all, open_executor
from mpmworlds.files.journal import append_records, read_records
from mpmworlds.files.parquet import write_parquet
from mpmworlds.files.targets import check_file
from mpmworlds.metrics import SCORED, View, score
from mpmworlds.metrics.clips import packed_colours
from mpmworlds.metrics.reduction import (
    Frames,
    prefix_length,
    reduce_clip,
    reduced_framerate,
    split_clip,
)
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.displace import displaced
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.assign import SplitParams
from mpmworlds.splits.lists import ListParams, evaluation_order

LEAST_CEILING: Final = 0.5  # mask IoU of a sample with itself, displaced by a hair
RERUNS: Final = 3
DIGITS: Final = 6  # of a ceiling: fewer than sums on other machines agree in


@dataclass(frozen=True)
class Measured:
    """What full runs of a sample showed.

    Attributes
    ----------
    id, program_sha256
        Which sample.
    status
        How the run ended, see `sim.run.run.Status`, or a displaced one that did not end
        well.
    motion
        Part of the foreground that changes in a second, see `measures.motion`, through
        at least half of the continuation.
    ceiling
        Noise ceiling of each metric: its mean between the continuation and those of
        `RERUNS` displaced runs, all as they are evaluated; None if the sample does not
        move enough to be run again.
    """

    id: str
    program_sha256: str
    status: str
    motion: float = 0.0
    ceiling: Mapping[str, float] | None = None

    @property
    def fault(self) -> str | None:
        """Why it is passed over; None if it is not."""
        if self.status != "ok":
            return self.status
        if self.motion < LEAST["motion"]:
            return "hardly_moves"
        if self.ceiling is None or self.ceiling["mask_iou"] < LEAST_CEILING:
            return "chaotic"
        return None


def measure(row: ManifestRow) -> Measured:
    """Run a sample in full and, if it moves, displaced."""
    scene = Scene.from_yaml(row.scene, row.id)
    program, rate = link(scene), scene.output.framerate
    outcome = run(program, trusted=True)
    found = Measured(row.id, row.program_sha256, outcome.status)
    if outcome.status != "ok":
        return found
    shown = packed_colours(outcome.frames[prefix_length(rate) - 1 :: STRIDE])
    found = replace(found, motion=round(motion(shown, rate), 4))
    if found.motion < LEAST["motion"]:
        return found
    reference = View(_hidden(outcome.frames, rate))
    scores = []
    for seed in range(RERUNS):
        again = run(displaced(program, seed), trusted=True)
        if again.status != "ok":
            return replace(found, status=again.status)
        scores.append(score(_hidden(again.frames, rate), reference))
    ceiling = {name: float(np.mean([s[name] for s in scores])) for name in SCORED}
    rounded = {name: round(value, DIGITS) for name, value in ceiling.items()}
    return replace(found, ceiling=rounded)


def _hidden(frames: Frames, framerate: int) -> Frames:
    """The part of a video that is to be predicted, as it is evaluated."""
    reduced = reduce_clip(frames, framerate)
    return split_clip(reduced, reduced_framerate(framerate))[1]


def measure_lists(
    rows: Sequence[ManifestRow],
    splits: SplitParams,
    lists: ListParams,
    path: Path,
    *,
    workers: int = 0,
    ray: str | None = None,
) -> list[Measured]:
    """Measure samples until all evaluation lists can be filled, and record them.

    Parameters
    ----------
    rows
        The manifest.
    splits, lists
        What the lists are.
    path
        Table to write. What has been measured so far is kept beside it in a journal,
        which ends in ``.jsonl``, so that a run that was stopped goes on.
    workers, ray
        Where the work is done, see `mpmworlds.builder.render.executors.open_executor`.

    Returns
    -------
    list of Measured
        All samples that a list would take before it is full, by id.

    Raises
    ------
    ValueError
        If a split has too few samples that are worth it.
    DiskFullError
        If there is no room. What is finished is kept.
    """
    check_file(path)
    by_id = {row.id: row for row in rows}
    orders = evaluation_order(by_id, splits, lists)
    journal = path.with_suffix(".jsonl")
    known = {
        m.id: m
        for m in (Measured(**record) for record in read_records(journal))
        if m.id in by_id and m.program_sha256 == by_id[m.id].program_sha256
    }
    total = sum(lists.evaluation.values())
    with (
        open_executor(measure, workers, ray) as executor,
        tqdm(total=total, desc="evaluation", unit="sample") as bar,
    ):
        while missing := _missing(orders, lists.evaluation, known):
            bar.n = total - len(missing)
            bar.set_postfix(passed_over=sum(bool(m.fault) for m in known.values()))
            tasks = [by_id[name] for name in missing]
            for _, found in carry_out_all(executor, tasks, lambda row: str(row.id)):
                append_records(journal, [asdict(found)])
                known[found.id] = found
                bar.update(found.fault is None)
    used = [known[name] for name in _walked(orders, lists.evaluation, known)]
    used.sort(key=lambda m: m.id)
    write_measured(path, used)
    return used


def _walked(
    orders: Mapping[str, Sequence[str]],
    counts: Mapping[str, int],
    known: Mapping[str, Measured],
) -> Iterable[str]:
    """Ids that lists take or pass over until they are full, as far as is known."""
    for split, order in orders.items():
        wanted = counts.get(split, 0)
        for name in order:
            if not wanted:
                break
            yield name
            wanted -= name not in known or known[name].fault is None
        else:
            if wanted:
                raise ValueError(
                    f"split {split!r}: {wanted} samples too few that move and are no "
                    "chaos; ask for a shorter list, or plan more samples"
                )


def _missing(
    orders: Mapping[str, Sequence[str]],
    counts: Mapping[str, int],
    known: Mapping[str, Measured],
) -> list[str]:
    """Ids that must be measured next, if all of them are to fill the lists."""
    return [name for name in _walked(orders, counts, known) if name not in known]


_TYPES: Final = {
    "motion": pa.float64(),
    "ceiling": pa.struct([(name, pa.float64()) for name in SCORED]),
}
_SCHEMA: Final = pa.schema(
    [pa.field(f.name, _TYPES.get(f.name, pa.string())) for f in fields(Measured)]
)


def write_measured(path: Path, found: Sequence[Measured]) -> None:
    """Write a table of what was measured, the same bytes for the same samples."""
    table = pa.Table.from_pylist([asdict(m) for m in found], schema=_SCHEMA)
    write_parquet(path, table)


def read_measured(path: Path) -> list[Measured]:
    """What `write_measured` wrote; raises `FileNotFoundError`."""
    return [Measured(**record) for record in pq.read_table(path).to_pylist()]


def recorded_measured(config: str) -> list[Measured]:
    """What is recorded with the package for a corpus; nothing for those without."""
    file = files("mpmworlds.builder") / "recorded" / f"{config}.evaluation.parquet"
    return read_measured(Path(str(file))) if file.is_file() else []


def passed_over(found: Iterable[Measured]) -> frozenset[str]:
    """Ids that no evaluation list takes."""
    return frozenset(m.id for m in found if m.fault)


def with_measured(
    rows: Iterable[ManifestRow], found: Collection[Measured]
) -> list[ManifestRow]:
    """Rows with what full runs of them showed."""
    by_id = {m.id: m for m in found if m.status == "ok"}
    return [
        replace(
            row,
            motion=by_id[row.id].motion,
            ceiling=by_id[row.id].ceiling,
        )
        if row.id in by_id and by_id[row.id].program_sha256 == row.program_sha256
        else row
        for row in rows
    ]
