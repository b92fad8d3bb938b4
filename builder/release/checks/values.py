"""The values of a row, each worked out anew from its id and its scene."""

import json
from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Any, Final, Literal

from mpmworlds.builder.plan.manifest import text_sha256
from mpmworlds.builder.release.features import columns_of
from mpmworlds.files.machine_yaml import read_machine_yaml
from mpmworlds.sim.program.link import link
from mpmworlds.sim.scene.errors import SceneError
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.splits.ids import SampleId, SampleIdError

Row = Mapping[str, Any]
_MAY_BE_NULL: Final = ("motion", "ceiling")


Depth = Literal["values", "output", "scene"]


def value_faults(row: Row, config: str, split: str, depth: Depth) -> Iterator[str]:
    """Say which values of a row are not what its id, its scene and its file make them.

    Parameters
    ----------
    row
        A row whose columns are those of the configuration.
    config, split
        What its file belongs to.
    depth
        How far to look into the scene: not at all ("values"); what it says of the
        video ("output"), of a row that is known to be right otherwise; or all of it
        ("scene"), and link it, which takes some ten milliseconds.

    Yields
    ------
    str
        What is wrong.
    """
    nulls = [
        name
        for name in (column.name for column in columns_of(config))
        if _is_null(row[name]) and name not in _MAY_BE_NULL
    ]
    if nulls:
        yield f"{', '.join(nulls)}: is null"
        return
    if row["split"] != split:
        yield f"split = {row['split']!r}, in a file of {split!r}"
    yield from _lineage_faults(row)
    yield from _media_faults(row)
    if text_sha256(row["scene"]) != row["scene_sha256"]:
        yield "its scene is not the one that scene_sha256 names"
    if "program" in row and text_sha256(row["program"]) != row["program_sha256"]:
        yield "its program is not the one that program_sha256 names"
    if depth == "output" and "framerate" in row:
        yield from _differences(row, _output_of(row["scene"]), "its scene")
    if depth == "scene":
        yield from _scene_faults(row)


def _is_null(value: Any) -> bool:
    if isinstance(value, dict):  # a file: its bytes and its name
        return any(part is None for part in value.values())
    return value is None or (isinstance(value, list) and None in value)


def _lineage_faults(row: Row) -> Iterator[str]:
    try:
        sample = SampleId.parse(row["id"])
    except SampleIdError as error:
        yield str(error)
        return
    expected = {
        "kind": sample.kind,
        "parent_id": sample.made_from,
        "family_id": sample.family,
    }
    yield from _differences(row, expected, "its id")
    if (row["edit"] == "") != (sample.kind == "seed") or not _is_edit(row["edit"]):
        yield f"edit = {row['edit']!r}, must be a JSON object, or empty for a seed"


def _is_edit(text: str) -> bool:
    if not text:
        return True
    try:
        return isinstance(json.loads(text), dict)
    except (ValueError, RecursionError):
        return False


def _media_faults(row: Row) -> Iterator[str]:
    """Names of the files in it, which are those that a reader may unpack them to."""
    endings = {
        "video": ".mp4",
        "clip": ".clip.mp4",
        "preview": ".preview.mp4",
        "poster": ".png",
    }
    for name, ending in endings.items():
        if name in row and row[name]["path"] != row["id"] + ending:
            yield f"{name}: path = {row[name]['path']!r}, must be its id and {ending!r}"


@lru_cache(1024)
def _output_of(scene: str) -> Row:
    """What a scene that is known to be valid says of its video."""
    data = read_machine_yaml(scene)
    return {
        "framerate": data["output"]["framerate"],
        "resolution": data["output"]["resolution"],
        "num_frames": data["simulation"]["duration_frames"],
    }


def _scene_faults(row: Row) -> Iterator[str]:
    facts = _facts_of(row["scene"])
    if isinstance(facts, str):
        yield facts
        return
    columns, program = facts
    yield from _differences(
        row, {k: v for k, v in columns.items() if k in row}, "its scene"
    )
    if program != row["program_sha256"]:
        yield "its scene links to another program than program_sha256 names"


@lru_cache(1024)  # a sample is in several configurations
def _facts_of(text: str) -> tuple[Row, str] | str:
    """What a scene makes of columns, and the hash of its program; or what is wrong."""
    try:
        scene = Scene.from_yaml(text)
    except SceneError as error:
        return f"its scene is not valid: {error.faults[0]}"
    materials = sorted(scene.materials)
    columns = {
        "materials": materials,
        "object_types": sorted({thing.object_type for thing in scene.objects}),
        "num_objects": len(scene.objects),
        "num_materials": len(materials),
        "framerate": scene.output.framerate,
        "resolution": scene.output.resolution,
        "num_frames": scene.simulation.duration_frames,
    }
    return columns, text_sha256(link(scene))


def _differences(row: Row, expected: Row, source: str) -> Iterator[str]:
    for name, value in expected.items():
        if row[name] != value:
            yield f"{name} = {row[name]!r}, {source} says {value!r}"
