"""Check the rows of one file of a release, each against itself."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import pyarrow as pa

from mpmworlds.builder.plan.manifest import text_sha256
from mpmworlds.builder.release.features import recipe_features, release_features
from mpmworlds.builder.release.layout import RECIPES
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.encode import decode_mp4, frames_sha256
from mpmworlds.sim.scene.errors import SceneError
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.uniform import uniform

ShardRow = Mapping[str, Any]
LINKED: Final = 1000  # rows of a file of recipes whose programs are linked, about


@dataclass(frozen=True)
class ToSimulate:
    """A row without findings; the ones of least rank are simulated again.

    It has its scene and no program: what is run is what that links to here, never a
    text of the release.
    """

    rank: str
    id: str
    scene: str
    frames_sha256: str


@dataclass
class ShardReport:
    """What was found in one file.

    Attributes
    ----------
    config, split
        What the file belongs to.
    findings
        One line per thing that is not as it must be.
    ids
        Ids of the rows, in order.
    recipes
        Id -> hash of the row's manifest columns.
    candidates
        The rows of least rank among those without findings.
    """

    config: str
    split: str
    findings: list[str] = field(default_factory=list)
    ids: list[str] = field(default_factory=list)
    recipes: dict[str, str] = field(default_factory=dict)
    candidates: list[ToSimulate] = field(default_factory=list)


def check_shard(root: Path, name: str, salt: str, resimulate: int) -> ShardReport:
    """Check one file of a release row by row.

    A rendered row must link to its program. So must a recipe, but that takes some ten
    milliseconds each, and a release may have many more recipes than videos: of a large
    file about `LINKED` rows are linked.

    Parameters
    ----------
    root
        Folder of the release.
    name
        Path of the file inside it, ``data/<config>/<split>-....arrow``.
    salt
        Decides, with the ids, which rows are linked and which are candidates.
    resimulate
        How many candidates to name.

    Returns
    -------
    ShardReport
        The findings, and what is needed to compare the files with each other.
    """
    _, config, file = name.split("/")
    report = ShardReport(config, file.partition("-")[0])
    features = recipe_features() if config == RECIPES else release_features()
    try:
        share = LINKED / max(_count_rows(root / name), 1) if config == RECIPES else 1.0
        with pa.OSFile(str(root / name), "rb") as source:
            stream = pa.ipc.open_stream(source)
            if stream.schema != features.arrow_schema:
                report.findings.append(
                    f"{root / name}: its columns or their types are not those of a "
                    f"release: {', '.join(stream.schema.names)}"
                )
                return report
            for batch in stream:
                for row in batch.to_pylist():
                    _check_row(row, file, salt, share, report)
                report.candidates = sorted(
                    report.candidates, key=lambda candidate: candidate.rank
                )[:resimulate]
    except (OSError, ValueError, pa.ArrowException) as error:
        report.findings.append(f"{root / name}: cannot be read ({error})")
    return report


def _count_rows(path: Path) -> int:
    with pa.OSFile(str(path), "rb") as source:
        return sum(batch.num_rows for batch in pa.ipc.open_stream(source))


def _check_row(
    row: ShardRow, file: str, salt: str, share: float, report: ShardReport
) -> None:
    sample_id = row["id"]
    report.ids.append(sample_id)
    recipe = json.dumps([row[name] for name in recipe_features()])
    report.recipes[sample_id] = text_sha256(recipe)
    rendered = report.config != RECIPES
    where = f"{file}: {sample_id}"
    found = [*_scene_findings(row)]
    if uniform(salt, "link", sample_id) <= share:
        found += _link_findings(row)
    found += _rendered_findings(row) if rendered else ()
    if row["split"] != report.split:
        found.append(f"split = {row['split']!r}, in another's file")
    report.findings += [f"{where}: {text}" for text in found]
    if rendered and not found:
        rank = hashlib.sha256(f"{salt}{sample_id}".encode()).hexdigest()
        report.candidates.append(
            ToSimulate(rank, sample_id, row["scene"], row["frames_sha256"])
        )


def _scene_findings(row: ShardRow) -> Iterator[str]:
    if text_sha256(row["scene"]) != row["scene_sha256"]:
        yield "its scene is not the one that scene_sha256 names"


def _link_findings(row: ShardRow) -> Iterator[str]:
    try:
        program = link(Scene.from_yaml(row["scene"], source=row["id"]))
    except SceneError as error:
        yield f"its scene is not valid: {error}"
        return
    if text_sha256(program) != row["program_sha256"]:
        yield "its scene links to another program than program_sha256 names"


def _rendered_findings(row: ShardRow) -> Iterator[str]:
    if text_sha256(row["program"]) != row["program_sha256"]:
        yield "its program is not the one that program_sha256 names"
    try:
        frames = decode_mp4(row["video"]["bytes"])
    except ValueError as error:
        yield f"its video cannot be decoded: {error}"
        return
    if frames_sha256(frames) != row["frames_sha256"]:
        yield "its video does not hold the frames that frames_sha256 names"
    found = (len(frames), frames.shape[1], frames.shape[2])
    expected = (row["num_frames"], row["resolution"], row["resolution"])
    if found != expected:
        yield f"its video is {found} (frames, height, width), the row says {expected}"
