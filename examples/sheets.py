"""Draw contact sheets of samples of a release into one picture.

    mpmworlds build --config mini --out release/mini
    python examples/sheets.py release/mini docs/mini.png --config mini

Without `--ids` it chooses samples of many materials and object types, one of a family.
"""

import argparse
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from datasets import get_dataset_split_names

import mpmworlds
from mpmworlds.files.atomic import write_atomically
from mpmworlds.loaders.load import Examples
from mpmworlds.sim.run.sheet import contact_sheet

TITLE = 20  # pixels
GREY = (200, 200, 200)
GAP = 12  # pixels between columns


def kinds_of(row: Mapping[str, Any]) -> set[str]:
    """Materials and object types of a row."""
    return {*row["materials"], *row["object_types"]}


def chosen(rows: Sequence[Mapping[str, Any]], count: int) -> list[str]:
    """Ids of rows, one of a family, rich in kinds that the others lack; sorted."""
    left = sorted(rows, key=lambda row: (-row["num_objects"], row["id"]))
    seen: Counter[str] = Counter()
    found = []
    while left and len(found) < count:
        best = max(left, key=lambda row: sum(0.5 ** seen[k] for k in kinds_of(row)))
        left = [row for row in left if row["family_id"] != best["family_id"]]
        seen.update(kinds_of(best))
        found.append(best["id"])
    return sorted(found)


def titled(sheet: np.ndarray, title: str) -> np.ndarray:
    """A sheet with a line of text above it."""
    line = np.zeros((TITLE, sheet.shape[1], 3), np.uint8)
    font = cv2.FONT_HERSHEY_SIMPLEX
    cv2.putText(line, title, (3, TITLE - 6), font, 0.45, GREY, 1, cv2.LINE_AA)
    return np.vstack([line, sheet])


def titled_sheets(
    splits: Sequence[Examples], ids: Sequence[str], frames: int, size: int
) -> Iterator[np.ndarray]:
    """The sheets of samples, in the order of their ids."""
    places = {
        name: (examples, number)
        for examples in splits
        for number, name in enumerate(examples.table["id"])
    }
    for name in ids:
        if name not in places:
            raise SystemExit(f"{name}: no sample of this configuration")
        examples, number = places[name]
        example = examples[number]
        clip = np.concatenate([example.prefix, example.continuation])
        title = f"{name}   {', '.join(example.row['materials'])}"
        yield titled(contact_sheet(clip, frames, size), title)


def page_of(sheets: Sequence[np.ndarray], columns: int) -> np.ndarray:
    """Sheets of one size in columns, filled from top to bottom."""
    rows = -(-len(sheets) // columns)
    blank = [np.zeros_like(sheets[0])] * (rows * columns - len(sheets))
    filled = [*sheets, *blank]
    gap = np.zeros((rows * sheets[0].shape[0], GAP, 3), np.uint8)
    parts = [np.vstack(filled[k * rows : (k + 1) * rows]) for k in range(columns)]
    return np.hstack([part for column in parts for part in (column, gap)][:-1])


def main() -> None:
    """Choose samples and write the picture."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("release", type=Path, help="folder of the release")
    parser.add_argument("out", type=Path, help="picture to write (.png)")
    parser.add_argument("--config", default="tiny", help="configuration (default tiny)")
    parser.add_argument("--ids", nargs="+", help="these samples")
    parser.add_argument("--samples", type=int, default=12, help="how many to choose")
    parser.add_argument("--frames", type=int, default=5, help="frames of each")
    parser.add_argument("--size", type=int, default=120, help="pixels of a frame")
    parser.add_argument("--columns", type=int, default=2, help="sheets side by side")
    options = parser.parse_args()

    names = get_dataset_split_names(str(options.release), options.config)
    splits = [mpmworlds.load(options.release, s, options.config) for s in names]
    columns = ["id", "family_id", "materials", "object_types", "num_objects"]
    rows = [row for s in splits for row in s.table.select_columns(columns)]
    ids = options.ids or chosen(rows, options.samples)
    sheets = list(titled_sheets(splits, ids, options.frames, options.size))
    page = cv2.cvtColor(page_of(sheets, options.columns), cv2.COLOR_RGB2BGR)
    _, data = cv2.imencode(".png", page, [cv2.IMWRITE_PNG_COMPRESSION, 9])
    write_atomically(options.out, data.tobytes())
    print(f"{options.out}: {len(ids)} samples, {len(data) / 1000:.0f} kB")


if __name__ == "__main__":
    main()
