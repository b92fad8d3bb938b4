"""A gallery's files: whole, the same every time, gone on with, and nobody else's."""

import json
import re
from pathlib import Path

import pytest

import mpmworlds.loaders.gallery.files as files_module
import mpmworlds.loaders.gallery.write as write_module
from mpmworlds.builder.release.build import build_release
from mpmworlds.builder.release.shards import Corpus
from mpmworlds.loaders.clips import clip_of
from mpmworlds.loaders.gallery.files import names_of
from mpmworlds.loaders.gallery.site import MARK, Site
from mpmworlds.loaders.gallery.source import Source, find_video
from mpmworlds.loaders.gallery.write import write_gallery
from mpmworlds.loaders.load import load
from mpmworlds.sim.run.preview import encode_preview, poster

SCRIPT = re.compile(r"(\w+)\((.*)\);\n", re.DOTALL)


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def files_of(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def told(path):
    return json.loads(SCRIPT.fullmatch(path.read_text("utf-8"))[2])


def ids_of(out):
    return [row[0] for row in told(out / "data.js")["rows"]]


@pytest.fixture(scope="module")
def site(release, tmp_path_factory):
    """A gallery of the whole release. Read-only."""
    out = tmp_path_factory.mktemp("gallery") / "site"
    written = write_gallery(release, out, workers=1)
    assert (written.samples, written.made) == (8, 8)
    assert written.page == out / "index.html"
    return out


def test_every_sample_has_its_files_and_nothing_else_is_there(site, corpus):
    ids = {row.id for row in corpus.rows}
    expected = set().union(*(names_of(name, exact=True) for name in ids))
    page = Path(write_module.__file__).parent / "page"
    expected |= {path.name for path in page.iterdir()}
    assert set(files_of(site)) == expected | {"data.js", "words.js", MARK}


def test_page_names_all_its_scripts_and_styles(site):
    page = (site / "index.html").read_text("utf-8")
    named = re.findall(r'(?:src|href)="([\w.]+)"', page)
    there = {path.name for path in site.iterdir() if path.suffix in (".js", ".css")}
    assert set(named) == there - {"words.js"}
    assert "://" not in page


def test_files_are_what_the_release_has(site, release):
    for split in ("train", "modification_validation", "test"):
        for row in load(release, split=split).table:
            name, clip = row["id"], clip_of(row)
            video = (site / f"videos/{name}.mp4").read_bytes()
            preview = (site / f"previews/{name}.mp4").read_bytes()
            assert video == row["video"]["bytes"]
            assert preview == encode_preview(*clip)
            assert (site / f"previews/{name}.png").read_bytes() == poster(clip.frames)
            sample = told(site / f"samples/{name}.js")
            assert (sample["scene"], sample["program"]) == (
                row["scene"],
                row["program"],
            )
            assert sample["exact"] == len(video)
            parent = f"# scene of {row['parent_id']}\n" if row["parent_id"] else None
            assert sample["parent"] == parent


def test_previews_that_the_release_has_are_not_made_again(
    site, corpus, tmp_path, monkeypatch
):
    with_previews = tmp_path / "mpmworlds"
    configs = {"tiny": None, "preview": ["p0000", "p0002"]}
    planned = Corpus(corpus.manifest, configs)
    build_release([planned], corpus.store, with_previews, version="1.2.3")
    made = []

    def counted(*arguments):
        made.append(arguments)
        return encode_preview(*arguments)

    monkeypatch.setattr(files_module, "encode_preview", counted)
    write_gallery(with_previews, tmp_path / "site", config="tiny", workers=1)
    assert len(made) == 6
    found, others = files_of(tmp_path / "site"), files_of(site)
    assert found.keys() == others.keys()
    names = {name for name in found if found[name] != others[name]}
    assert names == {"data.js"}  # which has the names of configurations as its title


def test_index_tells_what_filters_ask_for(site, corpus):
    index = told(site / "data.js")
    rows = {row.id: row for row in corpus.rows}
    assert [row[0] for row in index["rows"]] == sorted(rows)
    for name, parent, kind, split, materials, types, objects, motion in index["rows"]:
        row = rows[name]
        assert parent == row.parent_id
        assert index["kinds"][kind] == row.kind
        assert index["splits"][split] == row.split
        assert tuple(index["materials"][n] for n in materials) == row.materials
        assert tuple(index["types"][n] for n in types) == row.object_types
        assert (objects, motion) == (row.num_objects, row.motion)
    searched = told(site / "words.js")
    words = [{searched["words"][n] for n in row} for row in searched["rows"]]
    edited = [
        name
        for name, found in zip(sorted(rows), words, strict=True)
        if "jitter" in found
    ]
    assert edited == [name for name in sorted(rows) if rows[name].edit]


@pytest.mark.slow
def test_bytes_are_the_same_whatever_the_processes(site, release, tmp_path):
    write_gallery(release, tmp_path / "again", workers=2)
    assert files_of(tmp_path / "again") == files_of(site)


def test_stopped_gallery_goes_on_and_ends_the_same(
    site, release, tmp_path, monkeypatch
):
    done = []
    make = write_module._make

    def stopping(out, exact, task):
        if len(done) == 3:
            raise KeyboardInterrupt
        done.append(task)
        return make(out, exact, task)

    monkeypatch.setattr(write_module, "_make", stopping)
    out = tmp_path / "site"
    with pytest.raises(KeyboardInterrupt):
        write_gallery(release, out, workers=1)
    assert not (out / "index.html").exists()
    monkeypatch.undo()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert write_gallery(release, out, workers=1).made == 5
    assert files_of(out) == files_of(site)
    assert write_gallery(release, out, workers=1).made == 0
    (out / "previews/p0001.mp4").unlink()
    assert write_gallery(release, out, workers=1).made == 1
    assert files_of(out) == files_of(site)


def test_what_is_no_longer_chosen_goes(site, release, tmp_path):
    out = tmp_path / "site"
    write_gallery(release, out, split="test", workers=1)
    assert ids_of(out) == ["p0002", "p0002-n00"]
    write_gallery(release, out, ids={"p0002", "p0001"}, exact=False, workers=1)
    assert ids_of(out) == ["p0001", "p0002"]
    names = {"p0001.mp4", "p0001.png", "p0002.mp4", "p0002.png"}
    assert {path.name for path in (out / "previews").iterdir()} == names
    assert not (out / "videos").exists()
    assert told(out / "samples/p0001.js")["exact"] == 0
    assert write_gallery(release, out, limit=3, workers=1).samples == 3


def test_folder_that_holds_something_else_is_refused(release, tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(ValueError, match="holds files that are no gallery; name a new"):
        write_gallery(release, tmp_path, workers=1)
    assert (tmp_path / "thesis.tex").read_text() == "years of work"


def test_folder_that_is_being_written_is_refused(release, tmp_path):
    with (
        Site(tmp_path / "site"),
        pytest.raises(ValueError, match="another process is writing"),
    ):
        write_gallery(release, tmp_path / "site", workers=1)


@pytest.mark.parametrize(
    ("choice", "message"),
    [
        (
            {"config": "recipes"},
            "no configuration 'recipes' with videos and programs; it has mini, tiny",
        ),
        ({"split": "validation"}, "no split 'validation'; it has modification_valid"),
        ({"ids": {"p9999", "p0000"}}, "no video of p9999 in mini, tiny"),
        ({"limit": 0}, "limit = 0, must be at least 1"),
        ({"workers": -1}, "workers = -1, must be >= 0"),
    ],
)
def test_choice_that_cannot_be_meant_is_refused(choice, message, release, tmp_path):
    with pytest.raises(ValueError, match=re.escape(message)):
        write_gallery(release, tmp_path / "site", **choice)


def test_sample_named_like_a_path_is_refused():
    with pytest.raises(ValueError, match="must be named by letters"):
        names_of("../p0000", exact=True)


def test_families_stand_together_in_the_order_of_numbers(release):
    assert list(Source(release).choose("mini")) == ["p0000", "p0002"]


def test_video_is_found_by_id_and_program(release, corpus):
    row = corpus.rows[0]
    found = find_video(row.id, row.program_sha256, release)
    assert found["program"] == corpus.programs[row.id]
    assert find_video(row.id, "0" * 64, release) is None


def test_command_writes_the_chosen_samples(command, release, tmp_path):
    (tmp_path / "ids.txt").write_text("p0000\np0002\n")
    status, out, _ = command(
        *(
            "gallery",
            release,
            "--out",
            tmp_path / "site",
            "--ids",
            tmp_path / "ids.txt",
        ),
        *("--workers", 1, "--no-exact"),
    )
    page = tmp_path / "site" / "index.html"
    assert (status, out) == (0, f"{page}: 2 samples, 2 of them new\n")


def test_command_says_in_a_line_what_is_wrong(command, tmp_path):
    status, _, err = command("gallery", tmp_path, "--out", tmp_path / "site")
    assert status == 2
    assert err.count("\n") == 1
    assert "SHA256SUMS: is not there" in err
