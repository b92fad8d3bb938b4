"""The columns of a release: what each one holds, once for code and for the card."""

from dataclasses import dataclass
from typing import Any, Final

from datasets import Features, Image, List, Value, Video

from mpmworlds.builder.release.layout import CLIPS, PREVIEW, RECIPES
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

_VIDEO: Final = Column(
    "video",
    Video(decode=False),
    "what the program renders, lossless MP4: `bytes`, and a `path` to name it; not in "
    "configurations named `-clips`",
)
_NO_VIDEO_COLUMNS: Final = (
    Column("program", _TEXT, "the standalone Taichi program that implements the scene"),
    Column(
        "clip",
        Video(decode=False),
        "the video as it is trained on and evaluated, at most 256 px and 15 frames per "
        "second, lossless as well: frames and pixels are picked, never blended",
    ),
    Column("frames_sha256", _TEXT, "hash of the decoded RGB frames of the video"),
    Column("num_frames", _NUMBER, "number of frames of the video"),
    Column("framerate", _NUMBER, "its frames per second"),
    Column("resolution", _NUMBER, "its pixels along each side"),
)
RENDERED_COLUMNS: Final = (_NO_VIDEO_COLUMNS[0], _VIDEO, *_NO_VIDEO_COLUMNS[1:])
PREVIEW_COLUMNS: Final = (
    Column(
        "preview",
        Video(decode=False),
        "the clip for eyes, H.264 4:2:0: plays everywhere, and has lost colour",
    ),
    Column("poster", Image(decode=False), "a frame of it, PNG"),
)


def columns_of(config: str) -> tuple[Column, ...]:
    """Return the columns of a configuration, which its name decides."""
    if config == RECIPES:
        return RECIPE_COLUMNS
    if config == PREVIEW:
        return RECIPE_COLUMNS + PREVIEW_COLUMNS
    if config.endswith(CLIPS):
        return RECIPE_COLUMNS + _NO_VIDEO_COLUMNS
    return RECIPE_COLUMNS + RENDERED_COLUMNS


def features_of(config: str) -> Features:
    """Return the features of a configuration."""
    return Features({column.name: column.feature for column in columns_of(config)})


def release_features() -> Features:
    """Return the features of a rendered configuration: recipe, program and video."""
    return features_of("")


def recipe_features() -> Features:
    """Return the features of the configuration ``recipes``: no program, no video."""
    return features_of(RECIPES)
