"""The page: what a browser shows of a report, also from a disk.

A page that is opened from a disk may fetch nothing, so that data are scripts that call
a function: one for the page, and one for each sample, loaded when it is looked at.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.resources import files
from typing import Any, Final

from mpmworlds.baselines.report.board import Board
from mpmworlds.baselines.report.clips import SampleClips
from mpmworlds.baselines.report.folder import Folder
from mpmworlds.baselines.report.look import looks
from mpmworlds.baselines.report.rank import Ranking
from mpmworlds.baselines.report.series import CURVED
from mpmworlds.baselines.report.table import Table
from mpmworlds.baselines.report.tables import heading
from mpmworlds.baselines.results import CLIPS
from mpmworlds.baselines.system import System
from mpmworlds.metrics import SCORED
from mpmworlds.metrics.reduction import prefix_length

SOURCES: Final = ("index.html", "report.css", "report.js", "samples.js")
DIGITS: Final = 4  # of a curve on the page: less than a pixel


@dataclass(frozen=True, eq=False)
class Section:
    """What the page shows of a board."""

    board: Board
    """Its systems."""
    ranking: Ranking
    """Their order."""
    tables: Sequence[Table]
    """The ranking first, then the overviews, then those of the metrics."""
    figures: Sequence[tuple[str, str]]
    """Path from the page, without its suffix, and caption."""
    clips: Mapping[str, SampleClips]
    """Clips of each sample that has some."""


def write_page(
    folder: Folder,
    sections: Sequence[Section],
    others: Sequence[Table],
    notes: Sequence[str],
) -> None:
    """Write the page with its data.

    Parameters
    ----------
    folder
        Its folder; clips and figures are there already.
    sections
        What it shows, in this order.
    others
        Tables that belong to no board.
    notes
        What one must know of the whole.
    """
    for name in SOURCES:
        folder.write(name, files(__package__).joinpath("page", name).read_bytes())
    page: dict[str, Any] = {
        "metrics": [
            {
                "name": m.name,
                "heading": heading(m),
                "direction": m.direction,
                "curve": m.name in CURVED,
            }
            for m in SCORED.values()
        ],
        "notes": list(notes),
        "tables": [asdict(table) for table in others],
        "sections": [],
    }
    for section in sections:
        key = f"{section.board.config}-{section.board.split}"
        page["sections"].append(_section(key, section))
        for number, sample in enumerate(section.board.samples, 1):
            told = _sample(section, sample)
            path = f"samples/{key}/{number:04d}.js"
            folder.write(path, _script("onSample", told))
    folder.write("data.js", _script("onReport", page))


def _script(function: str, data: Any) -> bytes:
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return f"{function}({text});\n".encode()


def _section(key: str, section: Section) -> dict[str, Any]:
    board = section.board
    look = looks(board)
    with_clips = set().union(*(clip.predictions for clip in section.clips.values()))
    return {
        "key": key,
        "name": board.name,
        "framerate": board.framerate,
        "first": prefix_length(board.framerate),
        "systems": [
            {
                "label": system.label,
                **asdict(look[system.label]),
                "clips": system.label in with_clips,
            }
            for system in _in_order(section)
        ],
        "samples": board.samples,
        "tables": [asdict(table) for table in section.tables],
        "figures": [{"path": path, "caption": text} for path, text in section.figures],
        "without": _without(section),
    }


def _in_order(section: Section) -> list[System]:
    """Systems as they are ranked, the best first, then those that know the answers."""
    ranked = [place.system for place in section.ranking.places]
    systems = ranked or list(section.board.systems)
    return sorted(systems, key=lambda system: system.provenance.knows_answers)


def _without(section: Section) -> str:
    """What the sample browser cannot show, and why; empty if it shows all."""
    clips = section.clips.values()
    if not any(clip.predictions for clip in clips):
        where = f"no results have {CLIPS}/SAMPLE.mp4"
        if any(clip.reference for clip in clips):
            return f"References only: {where}."
        return f"No clips: {where}, and no release was named. Curves and scores only."
    if not any(clip.reference for clip in clips):
        return "No references and differences: name the release with --release."
    return ""


def _sample(section: Section, sample: str) -> dict[str, Any]:
    """What the page shows of a sample: scores and curves that the tables count."""
    first = section.board.systems[0].samples[sample][0]
    clips = section.clips.get(sample, SampleClips())
    systems = []
    for system in section.board.systems:
        chosen = {metric: system.chosen(metric)[sample] for metric in SCORED}
        curves = {
            metric: [round(value, DIGITS) for value in result.curves[metric]]
            for metric, result in chosen.items()
            if metric in CURVED and result.curves is not None
        }
        systems.append(
            {
                "label": system.label,
                "outcome": next(iter(chosen.values())).outcome,
                "reason": next(iter(chosen.values())).reason,
                "scores": {
                    metric: (result.continuation or {}).get(metric)
                    for metric, result in chosen.items()
                },
                "curves": curves,
                "clip": clips.predictions.get(system.label, ""),
                "difference": clips.differences.get(system.label, ""),
            }
        )
    return {
        "id": sample,
        "materials": first.materials,
        "objects": first.object_types,
        "count": first.num_objects,
        "motion": first.motion,
        "ceiling": first.ceiling,
        "reference": clips.reference,
        "systems": systems,
    }
