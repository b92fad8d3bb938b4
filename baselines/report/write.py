"""Results -> a folder with the whole report."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from tqdm import tqdm  # type: ignore[import-untyped]

from mpmworlds.baselines.provenance import release_sha256
from mpmworlds.baselines.report.board import (
    Board,
    Split,
    Splits,
    boards,
    read_systems,
)
from mpmworlds.baselines.report.clips import write_clips
from mpmworlds.baselines.report.figures import MISSING, drawn, render
from mpmworlds.baselines.report.folder import Folder
from mpmworlds.baselines.report.numbers import Entry, entries
from mpmworlds.baselines.report.page import Section, write_page
from mpmworlds.baselines.report.paper import paper
from mpmworlds.baselines.report.rank import Ranking, rank
from mpmworlds.baselines.report.table import (
    Table,
    csv_text,
    escape_markdown,
    latex,
    markdown,
    plain,
)
from mpmworlds.baselines.report.tables import (
    NUMBERS_HEADER,
    by_metric,
    numbers_rows,
    overview,
    ranking_table,
    statements_table,
)
from mpmworlds.baselines.system import ComparisonError, System
from mpmworlds.files.targets import check_folder
from mpmworlds.loaders.load import Examples, load
from mpmworlds.loaders.locate import is_release
from mpmworlds.metrics.reduction import reduced_framerate

SCHEMA: Final = "mpmworlds-report/1"
PREAMBLE: Final = "% Needs \\usepackage{booktabs,graphicx,textcomp}.\n"


@dataclass(frozen=True)
class Written:
    """A report that has been written."""

    data: dict[str, Any]
    """Its numbers, which lie in `report.json`."""
    text: str
    """What a terminal shows of it."""


def write_report(
    results: Sequence[str],
    out: Path,
    release: Path | None = None,
    *,
    common: bool = False,
) -> Written:
    """Compare results, and write tables, ranking, figures and a page.

    Parameters
    ----------
    results
        Folders of evaluations, `FOLDER` or `NAME=FOLDER`.
    out
        Folder to write to: `index.html`, `report.md`, `report.tex`, `numbers.csv`,
        `report.json`, `figures/`. What an earlier report has written there and this
        one does not is removed; other files stay.
    release
        Folder of the release that the results are of: tells how many samples there
        are, and gives the references of the page.
    common
        Compare over the samples that all systems of a split have.

    Returns
    -------
    Written
        A function of the results alone: no times, no paths.

    Raises
    ------
    OSError
        If the folder cannot be written to.
    ValueError
        If the results cannot be read or do not belong together.
    """
    check_folder(out)
    systems = read_systems(results)
    examples = _examples(release, systems) if release else {}
    found = boards(systems, _splits(examples), common=common)
    notes = _notes(found, release)
    folder = Folder(out)
    sections, numbers, data = [], [], []
    for board in found:
        # First, since a clip may turn out to be none.
        clips = write_clips(board, folder, examples.get((board.config, board.split)))
        scored, ranking = entries(board), rank(board)
        figures, missing = _figures(board, scored, folder)
        notes += [note for note in [missing] if note and note not in notes]
        tables = _tables(board, scored, ranking)
        sections.append(Section(board, ranking, tables, figures, clips))
        numbers += numbers_rows(board, scored)
        data.append(_data(board, scored, ranking))
    others = [statements_table(paper())]
    _write_tables(folder, sections, others, notes)
    numbers_csv = csv_text(NUMBERS_HEADER, numbers)
    folder.write("numbers.csv", numbers_csv.encode())
    whole = {"schema": SCHEMA, "notes": notes, "boards": data}
    text = json.dumps(whole, indent=2, allow_nan=False) + "\n"
    folder.write("report.json", text.encode())
    write_page(folder, sections, others, notes)
    folder.finish()
    shown = [plain(section.tables[0]) for section in sections]
    return Written(whole, "\n".join([*shown, f"{out / 'index.html'}: written\n"]))


def _examples(
    release: Path, systems: Sequence[System]
) -> dict[tuple[str, str], Examples]:
    """The splits that results are of, as the release has them."""
    if not is_release(release):
        raise ComparisonError(
            f"{release}: is no release; name the folder that `mpmworlds build --out` "
            "has written"
        )
    for system in systems:
        origin = system.provenance
        digest = release_sha256(release, origin.config)
        if origin.release_sha256 != digest:
            raise ComparisonError(
                f"{system.folder}: of {origin.config} {origin.release_sha256[:12]}, "
                f"but that of {release} is {digest[:12]}; name the release of the "
                "results"
            )
    keys = {(s.provenance.config, s.provenance.split) for s in systems}
    return {
        (config, split): load(release, split=split, config=config)
        for config, split in sorted(keys)
    }


def _splits(examples: Mapping[tuple[str, str], Examples]) -> Splits:
    """What the splits tell of their samples, which have one frame rate in common."""
    found = {}
    for key, some in examples.items():
        rates = sorted(set(map(reduced_framerate, some.table["framerate"])))
        if len(rates) != 1:
            raise ComparisonError(
                f"{'/'.join(key)}: clips have {rates} frames per second, must be one "
                "rate, since curves share an axis; divide the split"
            )
        found[key] = Split(list(some.table["id"]), rates[0])
    return found


def _notes(found: Sequence[Board], release: Path | None) -> list[str]:
    notes = [warning for board in found for warning in board.warnings]
    if release is None:
        notes.append("no release was named: expected are the samples of any system")
    for board in found:
        compared = len(board.samples)
        if any(evaluated != compared for evaluated in board.evaluated.values()):
            notes.append(f"{board.name}: compared over {compared} common samples only")
    return notes


def _figures(
    board: Board, scored: Sequence[Entry], folder: Folder
) -> tuple[list[tuple[str, str]], str]:
    """Write the figures; their paths and captions, and why there are none."""
    written = []
    figures = list(drawn(board, scored))
    for name, caption, draw in tqdm(
        figures, desc=f"figures of {board.name}", unit="figure"
    ):
        start = f"figures/{board.config}-{board.split}-{name}"
        try:
            pictures = render(draw)
        except ModuleNotFoundError:
            return [], MISSING
        for form, picture in pictures.items():
            folder.write(f"{start}.{form}", picture)
        written.append((start, caption))
    return written, ""


def _tables(board: Board, scored: Sequence[Entry], ranking: Ranking) -> list[Table]:
    overviews = [overview(board, scored, scale, paper()) for scale in ("raw", "beyond")]
    return [
        ranking_table(board, ranking, scored),
        *(table for table in overviews if table),
        *by_metric(board, scored),
    ]


def _write_tables(
    folder: Folder,
    sections: Sequence[Section],
    others: Sequence[Table],
    notes: Sequence[str],
) -> None:
    tables = [table for section in sections for table in section.tables]
    text = "\n".join(
        ["# Report\n", *(f"- {escape_markdown(note)}" for note in notes), ""]
        + [markdown(table) for table in (*tables, *others)]
    )
    folder.write("report.md", text.encode())
    tex = "\n".join([PREAMBLE, *map(latex, (*tables, *others))])
    folder.write("report.tex", tex.encode())


def _data(board: Board, scored: Sequence[Entry], ranking: Ranking) -> dict[str, Any]:
    return {
        "config": board.config,
        "split": board.split,
        "samples": len(board.samples),
        "expected": board.expected,
        "systems": [
            asdict(system.provenance) | {"name": system.name}
            for system in board.systems
        ],
        "ranking": [
            {"rank": p.rank, "system": p.system.label, "score": asdict(p.score)}
            for p in ranking.places
        ],
        "no_ranking": ranking.missing,
        "metrics": [
            {
                "system": entry.system.label,
                "metric": entry.metric.name,
                "direction": entry.metric.direction,
                "coverage": asdict(entry.coverage),
                "raw": asdict(entry.raw),
                "beyond": asdict(entry.beyond) if entry.beyond else None,
            }
            for entry in scored
        ],
    }
