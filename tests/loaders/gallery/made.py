"""A gallery of a release with real scenes and motions, which the release lacks."""

import json

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.loaders.gallery.files import key_of, names_of, write_files
from mpmworlds.loaders.gallery.index import index_of
from mpmworlds.loaders.gallery.site import Site
from mpmworlds.loaders.gallery.source import Source

EDIT = {"operator": "change_gravity", "from": [0.0, -9.8], "to": [2.0, -7.0]}


def rows_of(release):
    """Rows of a release: with the scenes of seeds, those that are made changed."""
    source = Source(release)
    rows = [place.row() for place in source.choose("tiny").values()]
    scenes = list(load_seeds().values())
    for number, row in enumerate(rows):
        family = int(row["family_id"][1:])
        text = scenes[family].to_yaml()
        if row["parent_id"]:
            text = text.replace("gravity: [0.0, -9.8]", f"gravity: [{number}.0, -7.0]")
            row["edit"] = json.dumps(EDIT)
        row["scene"], row["motion"] = text, number / 10
    return rows


def write_rows(rows, out):
    """Write a gallery of rows."""
    scenes = {row["id"]: row["scene"] for row in rows}
    names = {row["id"]: names_of(row["id"], exact=True) for row in rows}
    with Site(out) as site:
        for row in rows:
            parent = scenes.get(row["parent_id"])
            write_files(out, row, parent, exact=True)
            site.complete(row["id"], key_of(row, parent, exact=True))
        site.finish(index_of(rows, "made", exact=True), names)
