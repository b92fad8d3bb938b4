"""The columns of a release: what each one holds, once for code and for the card."""

from dataclasses import dataclass
from typing import Any, Final

from datasets import Features, List, Value, Video

from mpmworlds.metrics import SCORED


@dataclass(frozen=True)
class Column:
    """A column of the release.

    Attributes
    ----------
    name
        Its name.
    feature
        Its type, a feature of the ``datasets`` library.
    meaning
        What it holds, for the dataset card.
    """

    name: str
    feature: Any
    meaning: str


_TEXT: Final = Value("string")
_NUMBER: Final = Value("int32")
_MEASURE: Final = Value("float64")

RECIPE_COLUMNS: Final = (
    Column("id", _TEXT, "stable name that says the lineage, e.g. `p0123-c4-n07`"),
    Column("kind", _TEXT, "`seed`, `parent`, `child` or `perturbation`"),
    Column("parent_id", _TEXT, "row it was made from; empty for seeds and parents"),
    Column("family_id", _TEXT, "root of the lineage, e.g. `p0123`; never crosses test"),
    Column("seeds", List(_TEXT), "hand-made seed scenes it descends from"),
    Column("edit", _TEXT, "JSON of the operator that made it, with its arguments"),
    Column("split", _TEXT, "`train`, `modification_validation` or `test`"),
    Column("scene", _TEXT, "the YAML scene: everything that the simulation depends on"),
    Column("materials", List(_TEXT), "distinct constitutive models, sorted"),
    Column("object_types", List(_TEXT), "distinct object types, sorted"),
    Column("num_objects", _NUMBER, "number of objects"),
    Column("num_materials", _NUMBER, "number of distinct materials"),
    Column(
        "motion",
        _MEASURE,
        "part of the foreground that changes in a second of the continuation, median "
        "over time: by a full run for the evaluation lists, by a short trial for other "
        "templates, else null",
    ),
    Column(
        "ceiling",
        dict.fromkeys(SCORED, _MEASURE),
        "each metric between the continuation and those of three runs from places "
        "displaced by 1e-6: no prediction can be expected to do better; for the "
        "evaluation lists, else null",
    ),
    Column("scene_sha256", _TEXT, "SHA-256 of the scene text"),
    Column("program_sha256", _TEXT, "SHA-256 of the program text"),
)

RENDERED_COLUMNS: Final = (
    Column("program", _TEXT, "the standalone Taichi program that implements the scene"),
    Column(
        "video", Video(decode=False), "lossless MP4: `bytes`, and a `path` to name it"
    ),
    Column("frames_sha256", _TEXT, "hash of the decoded RGB frames"),
    Column("num_frames", _NUMBER, "number of frames"),
    Column("framerate", _NUMBER, "frames per second of video"),
    Column("resolution", _NUMBER, "pixels along each side"),
)


def release_features() -> Features:
    """Return the features of a rendered configuration: recipe, program and video."""
    return _features(RECIPE_COLUMNS + RENDERED_COLUMNS)


def recipe_features() -> Features:
    """Return the features of the configuration ``recipes``: no program, no video."""
    return _features(RECIPE_COLUMNS)


def _features(columns: tuple[Column, ...]) -> Features:
    return Features({column.name: column.feature for column in columns})
