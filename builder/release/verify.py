"""Check a release against itself and against the functions that it is a cache of."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from datasets.info import DatasetInfosDict
from huggingface_hub import DatasetCard

from mpmworlds.builder.release.layout import RECIPES
from mpmworlds.builder.release.shard_check import ShardReport, ToSimulate, check_shard
from mpmworlds.builder.render.executors import results_of
from mpmworlds.files.checksums import (
    CHECKSUMS,
    ChecksumError,
    files_below,
    read_checksums,
    sha256_of_file,
)
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.encode import frames_sha256
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.assign import SPLITS
from mpmworlds.splits.recorded_lists import SplitListError, read_lists

_Task = tuple[Path, str, str, int]  # arguments of `check_shard`


def verify_release(root: Path, resimulate: int = 1, workers: int = 1) -> list[str]:
    """Look for anything in a release that is not as it must be.

    Parameters
    ----------
    root
        Folder of the release.
    resimulate
        How many samples to simulate again and compare bit by bit, of those without
        findings. Which ones follows from the release, so that a check can be repeated.
    workers
        Number of processes, 0 for one per core.

    Returns
    -------
    list of str
        One line per finding, naming the file or the row; empty if all is well.

    Raises
    ------
    FileNotFoundError
        If the folder has no SHA256SUMS or README.md: it is no release.
    ValueError
        If `resimulate` is negative.
    """
    if resimulate < 0:
        raise ValueError(f"resimulate = {resimulate}, must be at least 0")
    try:
        sums = read_checksums(root)
    except ChecksumError as error:
        return [str(error)]
    findings = list(_file_findings(root, sums))
    reports = _check_shards(root, sums, resimulate, workers)
    for report in reports:
        findings += report.findings
    findings += _count_findings(root, reports)
    findings += _recipe_findings(root, reports)
    findings += _list_findings(root, reports)
    chosen = {c.id: c for report in reports for c in report.candidates}
    for candidate in sorted(chosen.values(), key=lambda c: c.rank)[:resimulate]:
        findings += _resimulation_findings(candidate)
    return findings


def _check_shards(
    root: Path, sums: Mapping[str, str], resimulate: int, workers: int
) -> list[ShardReport]:
    salt = sums.get("README.md", "")
    tasks = [
        (root, name, salt, resimulate)
        for name in sorted(sums)
        if name.endswith(".arrow") and (root / name).is_file()
    ]
    return results_of(
        _check_shard,
        tasks,
        lambda task: task[1],
        workers=workers,
        desc="verify",
        unit="shard",
    )


def _check_shard(task: _Task) -> ShardReport:
    return check_shard(*task)


def _file_findings(root: Path, sums: Mapping[str, str]) -> Iterator[str]:
    found = set(files_below(root))
    for name in sorted(sums):
        if name not in found:
            yield f"{root / name}: is missing, {CHECKSUMS} names it"
        elif sha256_of_file(root / name) != sums[name]:
            yield f"{root / name}: its sha256 is not the one in {CHECKSUMS}"
    for name in sorted(found - set(sums)):
        yield f"{root / name}: {CHECKSUMS} does not name it"


def _count_findings(root: Path, reports: Sequence[ShardReport]) -> Iterator[str]:
    card = DatasetCard.load(root / "README.md")
    infos = DatasetInfosDict.from_dataset_card_data(card.data)
    for config in sorted({*infos, *(report.config for report in reports)}):
        splits = infos[config].splits if config in infos else {}
        for split in SPLITS:
            said = splits[split].num_examples if split in splits else 0
            ids = _ids(reports, config, split)
            if said != len(ids):
                yield f"{root}: {config}/{split} has {len(ids)} rows, the card: {said}"
            if len(set(ids)) != len(ids):
                yield f"{root}: {config}/{split} has an id more than once"


def _ids(reports: Sequence[ShardReport], config: str, split: str) -> list[str]:
    place = (config, split)
    return [i for r in reports if (r.config, r.split) == place for i in r.ids]


def _recipe_findings(root: Path, reports: Sequence[ShardReport]) -> Iterator[str]:
    """Compare what rows of different configurations say of the same sample."""
    recipes: dict[str, str] = {}
    for report in reports:
        if report.config == RECIPES:
            recipes |= report.recipes
    for report in reports:
        for sample_id, recipe in report.recipes.items():
            if recipes.get(sample_id) != recipe:
                yield f"{root}: {sample_id} of {report.config} is not as in {RECIPES}"


def _list_findings(root: Path, reports: Sequence[ShardReport]) -> Iterator[str]:
    try:
        lists = read_lists(root / "splits")
    except (SplitListError, FileNotFoundError) as error:
        yield str(error)
        return
    for split in SPLITS:
        listed, rows = set(lists.get(split, ())), set(_ids(reports, RECIPES, split))
        for sample_id in sorted(listed ^ rows):
            place = f"splits/{split}.txt" if sample_id in listed else "the rows"
            yield f"{root}: {sample_id} of {split} is only in {place}"
    known = {i for split in SPLITS for i in _ids(reports, RECIPES, split)}
    for name in sorted(lists.keys() - set(SPLITS)):
        for sample_id in sorted(set(lists[name]) - known):
            yield f"{root}: {sample_id} of splits/{name}.txt is not in the rows"


def _resimulation_findings(candidate: ToSimulate) -> Iterator[str]:
    program = link(Scene.from_yaml(candidate.scene, candidate.id))
    outcome = run(program, trusted=True)  # no text of the release: it was linked here
    start = f"{candidate.id}: simulated again"
    if outcome.status != "ok":
        yield f"{start}: {outcome.status}: {outcome.message}"
    elif frames_sha256(outcome.frames) != candidate.frames_sha256:
        yield f"{start}, it gives other frames on this machine"
