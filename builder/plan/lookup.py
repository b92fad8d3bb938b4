"""Some rows of a recorded manifest, without reading the others."""

from collections.abc import Sequence
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc

from mpmworlds.builder.plan.manifest import (
    read_table,
    recorded_corpora,
    recorded_manifest,
)


def recorded_rows(ids: Sequence[str], config: str) -> dict[str, dict[str, Any]]:
    """Rows of a corpus that comes with the package.

    Parameters
    ----------
    ids
        Ids of samples.
    config
        Name of the corpus, such as `full`.

    Returns
    -------
    dict
        Id -> the columns of a manifest.

    Raises
    ------
    LookupError
        If there is no such corpus, or it has no such sample.
    """
    table = read_table(recorded_manifest(config))
    chosen = table.filter(pc.is_in(table.column("id"), pa.array(ids)))
    rows = {row["id"]: row for row in chosen.to_pylist()}
    for name in ids:
        if name not in rows:
            raise LookupError(
                f"{name}: is no sample of the corpus {config!r}; `mpmworlds "
                f"materialise --config {config} --list-ids` names them"
            )
    return rows


def recorded_namesakes(sample: str, config: str) -> list[str]:
    """Other corpora that come with the package and have a sample of the same id."""
    others = [name for name in recorded_corpora() if name != config]
    return [
        name
        for name in others
        if sample in read_table(recorded_manifest(name), ["id"])["id"].to_pylist()
    ]
