"""A release -> a folder with its gallery."""

from collections.abc import Collection
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from tqdm import tqdm  # type: ignore[import-untyped]

from mpmworlds.loaders.clips import VIDEO
from mpmworlds.loaders.gallery.files import key_of, names_of, write_files
from mpmworlds.loaders.gallery.index import index_of
from mpmworlds.loaders.gallery.site import PAGE, Site
from mpmworlds.loaders.gallery.source import Place, Source, preview_of
from mpmworlds.loaders.processes import in_order


@dataclass(frozen=True)
class Written:
    """A gallery that has been written."""

    page: Path
    """What to open."""
    samples: int
    """How many it shows."""
    made: int
    """How many of them were not there before."""


@dataclass(frozen=True)
class _Task:
    place: Place
    parent: str | None


def write_gallery(
    release: Path,
    out: Path,
    *,
    config: str | None = None,
    split: str | None = None,
    ids: Collection[str] | None = None,
    limit: int | None = None,
    exact: bool = True,
    workers: int = 0,
) -> Written:
    """Write a gallery, or bring it up to date; what is made already is kept.

    Parameters
    ----------
    release
        Folder of the release.
    out
        Folder of the gallery: new, empty, or a gallery.
    config, split, ids, limit
        Which samples, see `Source.choose`.
    exact
        Whether to have the exact videos in it, which are five times as large as the
        previews.
    workers
        Number of processes, 0 for one per core. The bytes do not depend on it.

    Returns
    -------
    Written
        A function of the release and what was chosen: no times, no paths.

    Raises
    ------
    OSError
        If there is no release, or the folder cannot be written to.
    ValueError
        If there is no such sample, or the folder holds something else.
    """
    source = Source(release)
    places = source.choose(config, split, ids, limit)
    rows = list(source.described(list(places.values())))
    parents = source.scenes({row["parent_id"] for row in rows})
    exact_of = {
        name: exact and VIDEO in source.columns(place.config)
        for name, place in places.items()
    }
    names = {name: names_of(name, exact=exact_of[name]) for name in places}
    keys = {
        row["id"]: key_of(row, parents.get(row["parent_id"]), exact=exact_of[row["id"]])
        for row in rows
    }
    with Site(out) as site:
        missing = [
            row["id"]
            for row in rows
            if not site.is_complete(row["id"], keys[row["id"]], names[row["id"]])
        ]
        site.begin(missing)
        made_from = {row["id"]: row["parent_id"] for row in rows}
        tasks = [_Task(places[name], parents.get(made_from[name])) for name in missing]
        done = in_order(partial(_make, out, exact), tasks, workers)
        bar = tqdm(
            done,
            desc="gallery",
            unit="sample",
            total=len(rows),
            initial=len(rows) - len(tasks),
        )
        for name in bar:
            site.complete(name, keys[name])
        title = config or " ".join(sorted({p.config for p in places.values()}))
        index = index_of(rows, title, exact=any(exact_of.values()))
        site.finish(index, names)
    return Written(out / PAGE, len(rows), len(tasks))


def _make(out: Path, exact: bool, task: _Task) -> str:
    row = task.place.row()
    shown = preview_of(task.place.release, row)
    write_files(out, row, task.parent, exact=exact, shown=shown)
    return str(row["id"])
