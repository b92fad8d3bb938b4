"""`croissant.json`: the release as machines read it (MLCommons Croissant 1.1, RAI 1.0).

Files have their checksums, columns their meanings. Readers of Croissant know no Arrow
streams, so it describes the records and leaves reading them to `datasets`.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from mpmworlds.builder.release.features import Column

DESCRIPTION: Final = (
    "2D Material Point Method simulations for inferring and extrapolating physical "
    "dynamics: each sample is a scene in YAML, the standalone Taichi program that "
    "implements it, and the video that the program renders, without loss. An "
    "independent reconstruction of the data set described in arXiv 2606.01538."
)
HOMEPAGE: Final = "https://github.com/mpmworlds/mpmworlds"
LICENCE: Final = "https://creativecommons.org/licenses/by/4.0/"
PAPER: Final = "https://arxiv.org/abs/2606.01538"
CITATION: Final = """\
@article{mpmworlds2026,
  title   = {MPMWorlds},
  journal = {arXiv preprint arXiv:2606.01538},
  year    = {2026}
}"""
_CREATOR: Final = {"@type": "Organization", "name": "The MPMWorlds contributors"}

_ARROW: Final = "application/vnd.apache.arrow.stream"
_FORMATS: Final = {
    ".arrow": _ARROW,
    ".json": "application/json",
    ".md": "text/markdown",
    ".parquet": "application/vnd.apache.parquet",
    ".txt": "text/plain",
    ".yaml": "application/yaml",
}
_TYPES: Final = {
    "bool": "sc:Boolean",
    "float32": "sc:Float",
    "float64": "sc:Float",
    "int32": "sc:Integer",
    "int64": "sc:Integer",
    "string": "sc:Text",
}

_CONTEXT: Final = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "arrayShape": "cr:arrayShape",
    "citeAs": "cr:citeAs",
    "column": "cr:column",
    "conformsTo": "dct:conformsTo",
    "containedIn": "cr:containedIn",
    "cr": "http://mlcommons.org/croissant/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "description": {"@container": "@language"},
    "equivalentProperty": "cr:equivalentProperty",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "extract": "cr:extract",
    "field": "cr:field",
    "fileObject": "cr:fileObject",
    "fileProperty": "cr:fileProperty",
    "fileSet": "cr:fileSet",
    "format": "cr:format",
    "includes": "cr:includes",
    "isArray": "cr:isArray",
    "isLiveDataset": "cr:isLiveDataset",
    "jsonPath": "cr:jsonPath",
    "key": "cr:key",
    "md5": "cr:md5",
    "name": {"@container": "@language"},
    "parentField": "cr:parentField",
    "path": "cr:path",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "recordSet": "cr:recordSet",
    "references": "cr:references",
    "regex": "cr:regex",
    "repeated": "cr:repeated",
    "replace": "cr:replace",
    "samplingRate": "cr:samplingRate",
    "sc": "https://schema.org/",
    "separator": "cr:separator",
    "source": "cr:source",
    "subField": "cr:subField",
    "transform": "cr:transform",
}

_RESPONSIBLE: Final = {
    "rai:dataCollection": (
        "Simulated. Scenes are composed from 35 hand-made seeds by seeded random "
        "streams, linked into programs, and run on one CPU thread; the bits of every "
        "video can be reproduced from its scene."
    ),
    "rai:dataCollectionType": ["Software Collection"],
    "rai:dataCollectionRawData": "None: scenes are the source, all else follows.",
    "rai:dataPreprocessingProtocol": [
        "Candidates that are invalid, repeat another or fail a short run are left out.",
        "Videos are stored without loss; clips at 256 px and 15 frames per second too.",
    ],
    "rai:dataAnnotationProtocol": (
        "None by people. Columns are computed from scenes, lists and runs."
    ),
    "rai:dataUseCases": [
        "Evaluating and training video prediction and program synthesis from video.",
        "Not for engineering: materials are chosen for variety, not measured.",
    ],
    "rai:dataLimitations": [
        "Two dimensions, a closed square of 1 m, a fixed camera, flat colours.",
        "Explicit MPM: numerical fracture, dissipation, contact at the grid's scale.",
        "Splashes are chaotic: no prediction can be exact; see the column `ceiling`.",
    ],
    "rai:dataBiases": [
        "Shares of materials and objects follow what the paper reports of its corpus.",
        "Liquid, snow and elastic bodies are most frequent.",
        "All scenes descend from 35 seeds, so their mechanisms recur.",
    ],
    "rai:dataSocialImpact": (
        "No people and no places. Generated programs are code: run those that a model "
        "wrote in a sandbox only."
    ),
    "rai:personalSensitiveInformation": ["None."],
    "rai:dataReleaseMaintenancePlan": (
        "A release never changes under its version, which is a tag of the repository. "
        "Corrections are new versions and stand in the card under Errata; ids, scenes "
        "and splits of existing samples stay when samples are added."
    ),
}


@dataclass(frozen=True)
class CroissantFile:
    """A file of the release: path, size [bytes], SHA-256."""

    path: str
    size: int
    sha256: str


def croissant_text(
    version: str,
    files: Sequence[CroissantFile],
    configs: Mapping[str, Sequence[Column]],
) -> str:
    """Return `croissant.json` of a release.

    Parameters
    ----------
    version
        Version of the data.
    files
        The files of the release, less SHA256SUMS and this one.
    configs
        Configuration -> its columns. Its files are those of `data/<configuration>/`.

    Raises
    ------
    ValueError
        If a configuration has no files.
    """
    ordered = sorted(files, key=lambda file: file.path)
    sets = [_file_set(name, ordered) for name in configs]
    told = {
        "@context": _CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": [
            "http://mlcommons.org/croissant/1.1",
            "http://mlcommons.org/croissant/RAI/1.0",
        ],
        "name": "MPMWorlds",
        "description": DESCRIPTION,
        "version": version,
        "license": LICENCE,
        "url": HOMEPAGE,
        "citeAs": CITATION,
        "creator": _CREATOR,
        "publisher": _CREATOR,
        "inLanguage": "en",
        "isLiveDataset": False,
        "isBasedOn": PAPER,
        "keywords": [
            "material point method",
            "physics simulation",
            "program synthesis",
            "video prediction",
        ],
        **_RESPONSIBLE,
        "distribution": [*map(_file_object, ordered), *sets],
        "recordSet": [_record_set(name, columns) for name, columns in configs.items()],
    }
    return json.dumps(told, indent=1, ensure_ascii=False) + "\n"


def _file_object(file: CroissantFile) -> dict[str, Any]:
    ending = file.path[file.path.rfind(".") :]
    return {
        "@type": "cr:FileObject",
        "@id": file.path,
        "name": file.path,
        "contentUrl": file.path,
        "contentSize": f"{file.size} B",
        "encodingFormat": _FORMATS.get(ending, "text/plain"),
        "sha256": file.sha256,
    }


def _file_set(config: str, files: Sequence[CroissantFile]) -> dict[str, Any]:
    start = f"data/{config}/"
    paths = [
        file.path
        for file in files
        if file.path.startswith(start) and "-of-" in file.path
    ]
    if not paths:
        raise ValueError(f"configuration {config!r}: has no files in {start}")
    return {
        "@type": "cr:FileSet",
        "@id": f"files-{config}",
        "name": f"files of {config}",
        "description": f"Arrow IPC streams of the configuration {config}",
        "containedIn": [{"@id": path} for path in paths],
        "encodingFormat": _ARROW,
        "includes": f"{start}*-of-*.arrow",
    }


def _record_set(config: str, columns: Sequence[Column]) -> dict[str, Any]:
    return {
        "@type": "cr:RecordSet",
        "@id": config,
        "name": config,
        "description": f"A row for each sample of the configuration {config}.",
        "key": {"@id": f"{config}/id"},
        "field": [_field(config, column) for column in columns],
    }


def _field(config: str, column: Column) -> dict[str, Any]:
    parts = column.feature if isinstance(column.feature, dict) else {}
    name = f"{config}/{column.name}"
    field = {
        "@type": "cr:Field",
        "@id": name,
        "name": column.name,
        "description": column.meaning,
        **({} if parts else _type(column.feature)),
        "source": _source(config, column.name),
    }
    if parts:
        field["subField"] = [
            {
                "@type": "cr:Field",
                "@id": f"{name}/{part}",
                "name": part,
                "description": f"{part}: {column.meaning}",
                **_type(feature),
                "source": _source(config, column.name),
            }
            for part, feature in parts.items()
        ]
    return field


def _source(config: str, column: str) -> dict[str, Any]:
    return {"fileSet": {"@id": f"files-{config}"}, "extract": {"column": column}}


def _type(feature: Any) -> dict[str, Any]:  # features have no common type
    inner = getattr(feature, "feature", None)
    if inner is not None:
        return {**_type(inner), "isArray": True, "arrayShape": "-1"}
    if feature._type == "Video":
        return {"dataType": "sc:VideoObject"}
    if feature._type == "Image":
        return {"dataType": "sc:ImageObject"}
    return {"dataType": _TYPES[feature.dtype]}
