"""Rows of a manifest by what is known of them: ids, splits, kinds and conditions.

A condition is one in SQL, as DuckDB and the SQL console of the Hugging Face Hub speak
it, for example ``'sand' in materials and num_objects >= 3``.
"""

from collections.abc import Collection, Iterable, Sequence
from difflib import get_close_matches
from typing import Final

import duckdb
import pyarrow as pa

from mpmworlds.builder.plan.manifest import SCHEMA, ManifestRow, operator_of
from mpmworlds.splits.uniform import uniform

# Of `edit` there is the operator's name alone.
COLUMNS: Final = tuple(name for name in SCHEMA.names if not name.endswith("_sha256"))
FEW_VALUES: Final = ("kind", "split", "edit", "materials", "object_types")
# A condition sees the rows and nothing else.
_SHUT: Final[dict[str, str | bool | int | float | list[str]]] = {
    "enable_external_access": "false",
    "python_enable_replacements": "false",
    "lock_configuration": "true",
}
_NAMED_AT_MOST = 3  # unknown ids that an error names


class SelectionError(ValueError):
    """A selection that cannot be meant."""


def matching(rows: Sequence[ManifestRow], where: str) -> set[str]:
    """Ids of the rows that satisfy a condition.

    Parameters
    ----------
    rows
        Rows of a manifest.
    where
        Condition in SQL on `COLUMNS`.

    Returns
    -------
    set of str
        There is at least one.

    Raises
    ------
    SelectionError
        If it is no condition, or no row satisfies it. Says where it is wrong, or which
        values there are.
    """
    with duckdb.connect(config=_SHUT) as connection:
        relation = connection.from_arrow(_table(rows))
        try:
            found = relation.filter(where).project("id").fetchall()
        except duckdb.Error as error:
            raise SelectionError(
                f"{where!r} is no condition on rows: {_said(error)}; columns: "
                f"{', '.join(COLUMNS)}"
            ) from error
        if not found:
            values = "; ".join(
                f"{name}: {', '.join(_values(relation, name))}" for name in FEW_VALUES
            )
            raise SelectionError(
                f"none of {len(rows):,} rows satisfies {where!r}; there are {values}"
            )
    return {name for (name,) in found}


def _table(rows: Sequence[ManifestRow]) -> pa.Table:
    columns = {name: [getattr(row, name) for row in rows] for name in COLUMNS}
    columns["edit"] = [operator_of(edit) if edit else "" for edit in columns["edit"]]
    return pa.table(columns, pa.schema([SCHEMA.field(name) for name in COLUMNS]))


def _said(error: duckdb.Error) -> str:
    """What DuckDB says, without the line that it drew."""
    return " ".join(str(error).partition("\n\nLINE")[0].split())


def _values(relation: duckdb.DuckDBPyRelation, name: str) -> list[str]:
    """All values of a column, or in its lists."""
    is_list = pa.types.is_list(SCHEMA.field(name).type)
    each = f"unnest({name})" if is_list else name
    found = relation.project(f"{each} as value").distinct().fetchall()
    return sorted(value for (value,) in found if value)


def select(
    rows: Sequence[ManifestRow],
    ids: Collection[str] = (),
    split: str | None = None,
    kind: str | None = None,
    where: str | None = None,
    sample: int | None = None,
    limit: int | None = None,
) -> list[ManifestRow]:
    """Select the rows that satisfy everything that is asked.

    Parameters
    ----------
    rows
        All rows of a manifest.
    ids
        Ids to keep; all if there are none.
    split, kind
        Split and kind to keep; all if None.
    where
        Condition in SQL, see `matching`.
    sample
        How many of these rows to draw at random. The draw belongs to the id, so it is
        always the same, and a smaller sample is the beginning of a larger one.
    limit
        Keep this many of the first.

    Returns
    -------
    list of ManifestRow
        In the order of the manifest, or of the draw.

    Raises
    ------
    SelectionError
        If an id or split is unknown, a number is not positive, or the condition is
        none or holds for no row.
    """
    _check_ids(ids, rows)
    splits = sorted({row.split for row in rows})
    if split is not None and split not in splits:
        raise SelectionError(f"split {split!r}: there are {', '.join(splits)}")
    for name, number in (("sample", sample), ("limit", limit)):
        if number is not None and number < 1:
            raise SelectionError(f"{name} = {number}, must be at least 1")
    wanted = set(ids) if ids else {row.id for row in rows}
    if where is not None:
        wanted &= matching(rows, where)
    found = [
        row
        for row in rows
        if row.id in wanted and split in (None, row.split) and kind in (None, row.kind)
    ]
    if sample is not None:
        found = sorted(found, key=lambda r: uniform("materialise", "sample", r.id))[
            :sample
        ]
    return found[:limit]


def _check_ids(ids: Iterable[str], rows: Sequence[ManifestRow]) -> None:
    known = {row.id for row in rows}
    unknown = [name for name in dict.fromkeys(ids) if name not in known]
    if not unknown:
        return
    named = [_named(name, known) for name in unknown[:_NAMED_AT_MOST]]
    more = len(unknown) - len(named)
    rest = f" and {more} more" if more else ""
    raise SelectionError(f"not in the manifest: {', '.join(named)}{rest}")


def _named(name: str, known: Collection[str]) -> str:
    """Quote an unknown id with the known one that is nearest to it."""
    # Within the family if there is one, else among the roots: a fraction of all ids.
    family = name.partition("-")[0]
    relatives = [i for i in known if i.partition("-")[0] == family]
    roots = (i for i in known if "-" not in i)
    near = get_close_matches(name, sorted(relatives or roots), 1)
    return f"{name!r} (nearest: {near[0]})" if near else repr(name)
