"""The plan of a corpus: every scene, its lineage and its split, before any is rendered.

Parents are chosen first, then each family on its own, by as many processes as there
are. A family that is planned is kept beside the manifest until all are, so that a plan
that was cut off goes on where it stopped; the bytes of the manifest depend on the
parameters only.
"""

import hashlib
import json
import shutil
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from tqdm import tqdm  # type: ignore[import-untyped]

from mpmworlds.builder.plan.candidates import Draft
from mpmworlds.builder.plan.families import (
    NEAR_ROOTS,
    Choice,
    Family,
    Planner,
    Screen,
    Step,
    Templates,
    carry_out,
    is_near,
)
from mpmworlds.builder.plan.manifest import (
    ManifestRow,
    read_manifest,
    text_sha256,
    write_manifest,
)
from mpmworlds.builder.plan.profile import Profile, sample_ids
from mpmworlds.builder.plan.screen import Findings
from mpmworlds.builder.plan.trials import append_journal, read_journal, read_recorded
from mpmworlds.builder.render.executors import Executor, carry_out_all, open_executor
from mpmworlds.builder.seeds import load_seeds
from mpmworlds.files.atomic import write_atomically
from mpmworlds.files.locks import hold
from mpmworlds.files.targets import check_file
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.ids import SampleId
from mpmworlds.splits.similarity import structure

SOURCES: Final = ("sim", "builder", "splits")  # folders that decide what is planned


@dataclass(frozen=True)
class Planned:
    """A plan.

    Attributes
    ----------
    rows
        The manifest, in the order of the ids.
    rejected
        How many candidates for templates were rejected, by kind and reason.
    trials
        Findings of all trials that it rests on.
    """

    rows: list[ManifestRow]
    rejected: dict[str, dict[str, int]]
    trials: dict[str, Findings]


@dataclass(frozen=True)
class _Work:
    """What the steps of a plan share."""

    profile: Profile
    parts: Path
    journal: Path
    executor: Executor[Step, Any]
    known: set[str]  # keys of trials that need no journal any more
    found: dict[str, Findings]  # of all trials that the plan rests on

    def keep(self, found: dict[str, Findings]) -> None:
        """Keep findings; new ones go to the journal first."""
        new = {key: f for key, f in found.items() if key not in self.known}
        if new:
            append_journal(self.journal, new)
            self.known.update(new)
        self.found.update(found)


def write_plan(
    profile: Profile,
    path: Path,
    *,
    workers: int = 0,
    ray: str | None = None,
    trials: Sequence[Path] = (),
) -> Planned:
    """Plan a corpus and write its manifest.

    Beside the manifest are kept, while it is made: families (``NAME.parts``) and the
    journal of trials (``NAME.trials.jsonl``). The counts of what was rejected go to
    ``NAME.rejected.json``.

    Parameters
    ----------
    profile
        What to plan.
    path
        File to write.
    workers, ray
        Where the work is done, see `mpmworlds.builder.render.executors.open_executor`.
    trials
        Tables of recorded findings of trials, which are then not run again.

    Returns
    -------
    Planned
        What was written, and what it rests on.

    Raises
    ------
    PlanError
        If the profile asks for a seed that there is not.
    NoCandidateError
        If no draw for a sample is a valid scene that passes.
    CutOffError
        If a process was killed again and again.
    DiskFullError
        If there is no room. What is finished is kept.
    FileExistsError
        If another process is planning the same file.
    """
    check_file(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    lock = hold(path.with_name(f".{path.name}.lock"))
    if lock is None:
        raise FileExistsError(
            f"{path}: another process is planning it; wait for it, or name another file"
        )
    with lock:
        return _plan(profile, path, workers, ray, trials)


def _plan(
    profile: Profile, path: Path, workers: int, ray: str | None, trials: Sequence[Path]
) -> Planned:
    journal = path.with_suffix(".trials.jsonl")
    known = read_recorded(trials)
    known |= read_journal(journal)
    Templates(profile, Screen(known))  # raises what is wrong with the profile
    parts = path.with_suffix(".parts")
    with open_executor(partial(carry_out, Planner(profile, known)), workers, ray) as ex:
        work = _Work(profile, parts, journal, ex, set(known), {})
        choices = _choose_parents(work)
        families = _plan_families(work, choices)
    rows = sorted((row for f in families for row in f.rows), key=lambda row: row.id)
    rejected = {
        "parents": _counted(reason for c in choices for reason in c.rejected),
        "children": _counted(reason for f in families for reason in f.rejected),
    }
    write_manifest(path, rows)
    text = json.dumps(rejected, indent=1, sort_keys=True) + "\n"
    write_atomically(path.with_suffix(".rejected.json"), text.encode())
    shutil.rmtree(parts, ignore_errors=True)
    return Planned(rows, rejected, work.found)


def _choose_parents(work: _Work) -> list[Choice]:
    """Seeds, and parents of which none nearly repeats a root before it."""
    roots = work.profile.roots()
    seeds = list(load_seeds().values())
    choices: dict[SampleId, Choice] = {}
    jobs: dict[SampleId, frozenset[int]] = dict.fromkeys(roots, frozenset())
    with tqdm(total=len(roots), desc="parents", unit="scene") as bar:
        while jobs:
            for sample, choice, found in _run(work, "root", list(jobs.items())):
                choices[sample] = choice
                work.keep(found)
                bar.update(bar.n < bar.total)
            choices = {sample: choices[sample] for sample in roots}
            jobs = _first_repeat(work.profile, choices, seeds)
    return list(choices.values())


def _first_repeat(
    profile: Profile, choices: dict[SampleId, Choice], seeds: Sequence[Scene]
) -> dict[SampleId, frozenset[int]]:
    """The first parent that nearly repeats a root before it, and draws it may not take.

    Those after it are looked at once it has been drawn anew. A seed counts, whether
    the corpus holds it or not, for the parents that could have been composed of it.
    """
    earlier: dict[str, list[Scene]] = defaultdict(list)  # parents by structure
    shapes = [structure(scene) for scene in seeds]
    for sample, choice in choices.items():
        if choice.draft.kind == "parent":
            scene = choice.draft.full
            batch = profile.batch_of(sample)[0]
            limit = len(seeds) if batch.proposals else batch.seeds
            shape = structure(scene)
            pairs = zip(seeds, shapes[:limit], strict=False)
            rivals = [seed for seed, other in pairs if other == shape]
            if is_near(scene, rivals + earlier[shape], NEAR_ROOTS):
                draws = enumerate(choice.rejected)
                before = [n for n, reason in draws if reason == "near_duplicate"]
                return {sample: frozenset([*before, choice.draw])}
            earlier[shape].append(scene)
    return {}


def _plan_families(work: _Work, choices: Sequence[Choice]) -> list[Family]:
    """All families: those that are kept already, and those that are missing."""
    families: dict[str, Family] = {}
    missing, places = [], {}
    source = _sources_sha256()
    for choice in choices:
        part = _part(work, choice.draft, source)
        if part.with_suffix(".json").exists():
            families[str(choice.draft.id)] = _read_part(part)
        else:
            missing.append((choice.draft.id, choice))
            places[choice.draft.id] = part
    total = len(sample_ids(work.profile))
    with tqdm(total=total, desc="families", unit="scene") as bar:
        bar.update(sum(len(f.rows) for f in families.values()))
        for sample, family in _run(work, "family", missing):
            work.keep(family.trials)
            _write_part(places[sample], family)
            families[str(sample)] = family
            bar.update(len(family.rows))
    for family in families.values():
        work.found.update(family.trials)
    return [families[str(choice.draft.id)] for choice in choices]


def _part(work: _Work, root: Draft, source: str) -> Path:
    """Where the family of a root is kept; another name if anything about it changes."""
    digest = text_sha256(
        "\n".join([source, repr(work.profile), str(root.id), root.key])
    )
    return work.parts / f"{root.id}-{digest[:16]}.parquet"


def _write_part(part: Path, family: Family) -> None:
    write_manifest(part, family.rows)
    trials = {key: asdict(found) for key, found in family.trials.items()}
    rest = json.dumps({"rejected": family.rejected, "trials": trials})
    write_atomically(part.with_suffix(".json"), rest.encode())


def _read_part(part: Path) -> Family:
    rest = json.loads(part.with_suffix(".json").read_bytes())
    trials = {key: Findings(**found) for key, found in rest["trials"].items()}
    return Family(read_manifest(part), rest["rejected"], trials)


def _sources_sha256() -> str:
    """Hash of all code and seeds that decide what is planned."""
    digest = hashlib.sha256()
    for folder in SOURCES:
        root = Path(str(files("mpmworlds").joinpath(folder)))
        paths = [p for p in root.rglob("*") if p.suffix in (".py", ".yaml")]
        for path in sorted(paths):
            digest.update(path.relative_to(root).as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()


def _run(work: _Work, step: str, jobs: Iterable[tuple[Any, ...]]) -> Iterator[Any]:
    """Results of a step as they are done."""
    tasks: list[Step] = [(step, *job) for job in jobs]
    done = carry_out_all(work.executor, tasks, lambda task: str(task[1]))
    return (result for _, result in done)


def _counted(reasons: Iterable[str]) -> dict[str, int]:
    return dict(Counter(reasons).most_common())
