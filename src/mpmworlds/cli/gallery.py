"""Verbs to look at samples: gallery, play."""

import argparse
import webbrowser
from pathlib import Path
from typing import Any

from mpmworlds.cli.common import (
    DONE,
    SCENE_FILE,
    WHOSE,
    add_workers,
    new_verb,
    say,
    say_where,
)
from mpmworlds.files.text import read_text

SCENES = (".yaml", ".yml")
PLAYED = Path("work/play")


def add_gallery(verbs: Any) -> None:
    """Add the verb `gallery`."""
    parser = new_verb(
        verbs,
        gallery,
        "write a page to look at the samples of a release, which needs no server",
        "mpmworlds gallery release/mpmworlds --out site",
    )
    parser.add_argument("release", type=Path, help="folder of a release")
    parser.add_argument(
        "--out", type=Path, required=True, help="folder of the page; go on with it"
    )
    parser.add_argument(
        "--config", help="configuration (default: all that have videos)"
    )
    parser.add_argument("--split", help="split (default: all)")
    parser.add_argument("--ids", type=Path, metavar="FILE", help="only these ids")
    parser.add_argument("--limit", type=int, metavar="N", help="the first N only")
    parser.add_argument(
        "--no-exact",
        dest="exact",
        action="store_false",
        help="previews only: a fifth of the size",
    )
    add_workers(parser)


def gallery(options: argparse.Namespace) -> int:
    """Write the gallery of a release."""
    from mpmworlds.loaders.gallery.write import write_gallery

    ids = set(read_text(options.ids).split()) if options.ids else None
    written = write_gallery(
        options.release,
        options.out,
        config=options.config,
        split=options.split,
        ids=ids,
        limit=options.limit,
        exact=options.exact,
        workers=options.workers,
    )
    print(f"{written.page}: {written.samples} samples, {written.made} of them new")
    return DONE


def add_play(verbs: Any) -> None:
    """Add the verb `play`."""
    parser = new_verb(
        verbs,
        play,
        "render a scene, or a sample of the corpus, and open a page that plays it",
        "mpmworlds play scene.yaml",
    )
    parser.description += f" {WHOSE}"
    parser.add_argument("source", help="scene (.yaml), or id of a sample")
    parser.add_argument(
        "--config",
        help="corpus that an id is of (default: full, unless only another one has it "
        "in --release)",
    )
    parser.add_argument(
        "--release",
        type=Path,
        help="take the video from there (default: the release that is here, if any)",
    )
    parser.add_argument(
        "--out", type=Path, help=f"folder of the page (default {PLAYED}/NAME)"
    )
    parser.add_argument(
        "--no-open",
        dest="open",
        action="store_false",
        help="say where the page is, and open no browser",
    )


def play(options: argparse.Namespace) -> int:
    """Write a page with one sample, and open it."""
    from mpmworlds.loaders.gallery.play import row_of_scene, write_play
    from mpmworlds.sim.scene.scene import Scene

    path = Path(options.source)
    if path.suffix in SCENES:
        text = read_text(path, f"{SCENE_FILE}, or the id of a sample")
        scene = Scene.from_yaml(text, str(path))
        row, parent = row_of_scene(scene, path.stem), None
    else:
        row, parent = _sample(options)
    page = write_play(row, options.out or PLAYED / row["id"], parent)
    print(page)
    if options.open and not webbrowser.open(page.absolute().as_uri()):
        say("there is no browser to open it with; open it yourself")
    return DONE


def _sample(options: argparse.Namespace) -> tuple[dict[str, Any], str | None]:
    """A row with its video, if a release here has it, and its parent's scene."""
    from mpmworlds.builder.plan.lookup import recorded_namesakes, recorded_rows
    from mpmworlds.loaders.gallery.source import find_video
    from mpmworlds.splits import SampleId

    sample = SampleId.parse(options.source)
    names = [name for name in (str(sample), sample.made_from) if name]
    corpus = options.config or _corpus(options.release, str(sample))
    rows = recorded_rows(names, corpus)
    others = () if options.config else recorded_namesakes(str(sample), corpus)
    say_where(str(sample), f"the recorded corpus {corpus}", others)
    row = rows[str(sample)]
    found = find_video(row["id"], row["program_sha256"], options.release)
    parent = rows[sample.made_from]["scene"] if sample.made_from else None
    return found or row, parent


def _corpus(release: Path | None, sample: str) -> str:
    """The corpus that an id is of: in a release that is named, the one that has it."""
    from mpmworlds.builder.release.layout import MAIN, read_record
    from mpmworlds.builder.release.rows import any_row

    if release is None:
        return MAIN
    try:
        config, _ = any_row(release, sample)
    except LookupError:
        return MAIN
    return read_record(release).configs[config].corpus
