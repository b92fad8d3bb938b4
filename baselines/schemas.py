"""JSON Schemas of what an evaluation writes, for whoever reads it by other tools."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final, Literal, NotRequired

from pydantic import TypeAdapter
from typing_extensions import TypedDict

from mpmworlds.baselines.provenance import Provenance
from mpmworlds.baselines.results import Result
from mpmworlds.metrics import Interval

DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"


class MetricSummary(TypedDict):
    """One metric of one system."""

    direction: Literal["up", "down"]
    valid: Interval
    failures_at_worst: Interval


Metrics = dict[str, MetricSummary]


class Summary(TypedDict):
    """A ``summary.json``."""

    schema: str
    provenance: Provenance
    definition: dict[str, Any]
    expected: int
    samples: int
    troubles: dict[str, str]
    candidates: int
    outcomes: dict[str, int]
    continuation: Metrics
    prefix: NotRequired[Metrics]
    choices: NotRequired[dict[str, Metrics]]
    slices: dict[str, dict[str, Metrics]]


def _of_results() -> dict[str, Any]:
    """Of a line of ``results.jsonl``: a result and its provenance, side by side."""
    one, other = (TypeAdapter(kind).json_schema() for kind in (Result, Provenance))
    fields = {**one["properties"], **other["properties"]}
    return {
        "$schema": DIALECT,
        "title": "A line of results.jsonl",
        "type": "object",
        "properties": fields,
        "required": list(fields),
        "additionalProperties": False,
    }


def _of_summary() -> dict[str, Any]:
    return {"$schema": DIALECT, **TypeAdapter(Summary).json_schema()}


SCHEMAS: Final[Mapping[str, Any]] = MappingProxyType(
    {"results": _of_results, "summary": _of_summary}
)
"""What it is of -> maker of its JSON Schema."""
