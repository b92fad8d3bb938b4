"""Nothing stale, damaged or foreign is served: one test for each way to come by it."""

import json
import os
import shutil
import subprocess
import sys
import textwrap
from dataclasses import replace

import pyarrow as pa
import pytest

from mpmworlds.builder.plan.manifest import write_manifest
from mpmworlds.builder.release.build import build_release
from mpmworlds.builder.release.features import release_features
from mpmworlds.builder.release.shards import Corpus
from mpmworlds.files.checksums import ChecksumError, write_checksums
from mpmworlds.loaders.load import load
from tests.hub import Hub

TEST = "data/tiny/test-00000-of-00001.arrow"
IMPORTS = """
import json, sys
import mpmworlds
from datasets import load_dataset
def ids(rows): return [row["id"] for row in rows]
def failed(do):
    try:
        do()
    except Exception as error:
        return f"{type(error).__name__}: {error}"
"""


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def python(tmp_path):
    """Function that runs statements in a process and returns what `found` is."""

    def run(statements, imports=IMPORTS, **environment):
        kept = {
            k: v
            for k, v in os.environ.items()
            if not k.startswith(("HF_", "MPMWORLDS_"))
        }
        kept |= {"HF_HOME": str(tmp_path / "hf"), "HF_HUB_OFFLINE": "1"}
        code = (
            imports + textwrap.dedent(statements) + "\nprint('\\n' + json.dumps(found))"
        )
        done = subprocess.run(
            [sys.executable, "-c", code],
            cwd=tmp_path,
            env=kept | environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout.splitlines()[-1])

    return run


@pytest.fixture
def copy(release, tmp_path):
    return shutil.copytree(release, tmp_path / "mpmworlds")


def rewrite(path, change):
    """Write the rows of a file anew, changed, in batches of one."""
    schema = release_features().arrow_schema
    rows = change(pa.ipc.open_stream(path.read_bytes()).read_all().to_pylist())
    with pa.ipc.new_stream(str(path), schema) as writer:
        for row in rows:
            writer.write_batch(pa.RecordBatch.from_pylist([row], schema=schema))


def flip(path):
    data = bytearray(path.read_bytes())
    data[data.find(b"mdat") + 40] ^= 1
    path.write_bytes(data)


CHANGES = {
    "reversed": lambda rows: rows[::-1],
    "dropped": lambda rows: rows[:1],
    "duplicated": lambda rows: [*rows, rows[0]],
    "another in its place": lambda rows: [rows[0], rows[0]],
}


@pytest.mark.parametrize("sums", ["stale", "fixed up"])
@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_rows_that_are_not_those_that_were_built_are_refused(
    python, copy, change, sums
):
    rewrite(copy / TEST, change)
    if sums == "fixed up":
        write_checksums(copy)
    found = python("""
    found = {
        "datasets": failed(lambda: load_dataset("mpmworlds", "tiny", split="test")),
        "stream": failed(lambda: ids(
            load_dataset("mpmworlds", "tiny", split="test", streaming=True))),
        "load": failed(lambda: mpmworlds.load("tiny")),
        "ids": failed(lambda: mpmworlds.load("tiny", ids=["p0002", "p0002-n00"])),
    }
    """)
    for way, said in found.items():
        assert said and said.startswith("ChecksumError: "), (way, said)
        assert TEST in said and "release again" in said


def test_what_was_loaded_before_is_not_served_for_what_is_there_now(
    python, corpus, tmp_path
):
    def build(rows):
        write_manifest(tmp_path / "m", rows)
        planned = Corpus(tmp_path / "m", {"tiny": None})
        build_release([planned], corpus.store, tmp_path / "mpmworlds", version="1.0.0")

    load_it = """
    found = [row["edit"] for row in load_dataset("mpmworlds", "tiny", split="test")]
    """
    plain = "import json\nfrom datasets import load_dataset\n"
    build(corpus.rows)
    before = python(load_it), python(load_it.replace("mpmworlds", "./mpmworlds"), plain)
    build(
        [replace(row, edit=row.edit and '{"operator": "other"}') for row in corpus.rows]
    )
    after = python(load_it), python(load_it.replace("mpmworlds", "./mpmworlds"), plain)
    assert before == (["", '{"operator": "jitter"}'],) * 2
    assert after == (["", '{"operator": "other"}'],) * 2


def test_what_was_loaded_unchecked_is_not_served_by_a_checked_load(python, copy):
    whole = (copy / TEST).read_bytes()
    flip(copy / TEST)
    plain = "import json\nfrom datasets import load_dataset\n"
    video = """
    import hashlib
    rows = load_dataset("./mpmworlds", "tiny", split="test")
    found = [hashlib.sha256(row["video"]["bytes"]).hexdigest() for row in rows]
    """
    damaged = python(video, plain)
    (copy / TEST).write_bytes(whole)
    repaired = python(video)
    assert repaired != damaged
    rows = pa.ipc.open_stream(whole).read_all().to_pylist()
    import hashlib

    assert repaired == [hashlib.sha256(r["video"]["bytes"]).hexdigest() for r in rows]


def test_another_folders_build_is_not_served_from_an_empty_one(python, copy):
    python('found = ids(load_dataset("mpmworlds", "tiny", split="test"))')
    shutil.rmtree(copy)
    copy.mkdir()
    found = python("""
    found = {
        "datasets": failed(lambda: load_dataset("mpmworlds", "tiny", split="test")),
        "load": failed(lambda: mpmworlds.load("tiny")),
    }
    """)
    for said in found.values():
        assert said.startswith("ReleaseNotFoundError: mpmworlds: there is no release")
        assert "mpmworlds build --config mini --out release/mpmworlds" in said
        assert "core-hours" in said


def test_without_a_release_and_a_hub_how_to_build_one_is_said_in_seconds(python):
    found = python(
        """
    import time
    start = time.monotonic()
    found = {
        "datasets": failed(lambda: load_dataset("mpmworlds", "tiny")),
        "ids": failed(lambda: mpmworlds.load("tiny", ids=["p0002"])),
        "seconds": time.monotonic() - start,
    }
    """,
        HF_HUB_OFFLINE="0",
        HF_ENDPOINT="http://127.0.0.1:9",  # where nothing listens
    )
    assert found.pop("seconds") < 12
    for said in found.values():
        assert said.startswith("ReleaseNotFoundError: mpmworlds: there is no release")
        assert "Connection refused" in said
        assert "mpmworlds build --config tiny --out release/mpmworlds" in said


def test_a_configuration_that_is_not_there_is_answered_with_how_to_make_it(
    python, copy
):
    found = python("""
    found = {
        "datasets": failed(lambda: load_dataset("mpmworlds", "10k")),
        "load": failed(lambda: mpmworlds.load("10k")),
        "ids": failed(lambda: mpmworlds.load("10k", ids=["p0002"])),
    }
    """)
    for said in found.values():
        assert "has no configuration '10k'; it has tiny, mini, recipes" in said
        assert f"mpmworlds build --config 10k --out {copy}" in said
        assert "about 50 core-hours and 8 GB" in said


def test_damage_of_one_configuration_leaves_the_others_alone(python, copy):
    flip(copy / TEST)
    found = python("""
    found = {
        "recipes": len(load_dataset("mpmworlds", "recipes", split="train")),
        "mini": ids(load_dataset("mpmworlds", "mini", split="test")),
        "tiny": failed(lambda: load_dataset("mpmworlds", "tiny")),
    }
    """)
    assert (found["recipes"], found["mini"]) == (5, ["p0002"])
    assert "p0002" in found["tiny"] and "not those that were built" in found["tiny"]


def test_a_part_of_a_release_is_as_good_as_a_whole_one(python, copy):
    shutil.rmtree(copy / "data/tiny")
    found = python("""
    found = {
        "mini": ids(load_dataset("mpmworlds", "mini", split="test")),
        "tiny": failed(lambda: load_dataset("mpmworlds", "tiny")),
    }
    """)
    assert found["mini"] == ["p0002"]
    assert "is missing; fetch or build the release again" in found["tiny"]


def test_files_that_change_places_are_refused(copy):
    first, second = (copy / f"data/tiny/train-0000{k}-of-00003.arrow" for k in (0, 1))
    data = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(data)
    with pytest.raises(ChecksumError, match="train-00000-of-00003"):
        load(copy, "train")


# ---- from the Hub


@pytest.fixture
def served(release, tmp_path):
    with Hub(tmp_path / "hub") as hub:
        yield hub, hub.serve(release, "acme/mpmworlds", tag="1.2.3")


def over(hub, tmp_path):
    return hub.environment(tmp_path / "hf") | {"HF_HUB_OFFLINE": "0"}


def test_a_byte_flipped_on_the_hub_is_an_error_in_every_way(python, served, tmp_path):
    hub, repository = served
    repository.flip_byte(TEST, len(repository.read(TEST)) // 2)
    found = python(
        """
    name = "acme/mpmworlds"
    found = {
        "datasets": failed(lambda: load_dataset(name, "tiny", split="test")),
        "stream": failed(lambda: ids(
            load_dataset(name, "tiny", split="test", streaming=True))),
        "load": failed(lambda: mpmworlds.load(name, config="tiny")),
        "ids": failed(lambda: mpmworlds.load(
            name, config="tiny", ids=["p0002", "p0002-n00"])),
        "others": ids(load_dataset(name, "mini", split="test")),
    }
    """,
        **over(hub, tmp_path),
    )
    assert found.pop("others") == ["p0002"]
    for way, said in found.items():
        assert said and TEST in said and "not those that were built" in said, way


def test_a_file_that_the_hub_lacks_is_an_error_before_the_first_row(
    python, served, tmp_path
):
    hub, repository = served
    repository.remove("data/tiny/train-00001-of-00003.arrow")
    found = python(
        """
    stream = lambda: next(iter(load_dataset(
        "acme/mpmworlds", "tiny", split="train", streaming=True)))
    found = [failed(stream),
             failed(lambda: load_dataset("acme/mpmworlds", "tiny", split="train"))]
    """,
        **over(hub, tmp_path),
    )
    for said in found:
        assert "data/tiny/train-00001-of-00003.arrow: is missing" in said


def test_what_was_loaded_from_the_hub_loads_without_it(python, served, tmp_path):
    hub, _ = served
    bare = """
    import mpmworlds.loaders.locate as locate
    locate.HUB_REPOSITORY = "acme/mpmworlds"
    """
    first = bare + 'found = ids(load_dataset("mpmworlds", "mini", split="test"))'
    assert python(first, **over(hub, tmp_path)) == ["p0002"]
    found = python(
        bare
        + """
    found = {
        "again": ids(load_dataset("mpmworlds", "mini", split="test")),
        "load": mpmworlds.load("mini")[0].id,
        "other": failed(lambda: load_dataset("mpmworlds", "tiny")),
    }
    """,
        HF_HOME=over(hub, tmp_path)["HF_HOME"],
    )
    assert (found["again"], found["load"]) == (["p0002"], "p0002")
    assert "is missing" in found["other"]


def test_single_samples_come_by_ranges(python, served, tmp_path):
    hub, _ = served
    hub.sent.clear()
    found = python(
        """
    examples = mpmworlds.load("acme/mpmworlds", ids=["p0002-n00"], revision="1.2.3")
    found = [[e.id, len(e.prefix)] for e in examples]
    """,
        **over(hub, tmp_path),
    )
    assert found == [["p0002-n00", 6]]
    arrows = [path for path in hub.sent if path.endswith(".arrow")]
    assert {path.rpartition("/")[2] for path in arrows} <= {
        "index.arrow",
        "test-00000-of-00001.arrow",
    }


# ---- the grammar of load_dataset


def test_splits_are_written_as_for_load_dataset(release):
    def ids(split):
        return [example.id for example in load(release, split)]

    train = ids("train")
    assert ids("train[1:3]") == train[1:3]
    assert ids("train[:40%]") == train[:2]
    assert ids("test+train[-1:]") == [*ids("test"), train[-1]]
    with pytest.raises(ValueError, match=r"has no split tiny/test\[a:\]"):
        load(release, "test[a:]")


def test_a_stream_of_examples_can_be_cut(release):
    stream = load(release, "train", streaming=True)
    assert [e.id for e in stream.skip(1).take(2)] == ["p0000-c0", "p0000-c0-n00"]


def test_single_samples_of_any_split_come_in_the_order_asked_for(release):
    examples = load(release, ids=["p0002", "p0000", "p0000-c1"])
    assert [e.id for e in examples] == ["p0002", "p0000", "p0000-c1"]
    with pytest.raises(ValueError, match="p9999 is not in configuration 'mini'"):
        load(release, ids=["p9999"], config="mini")
    with pytest.raises(ValueError, match="p9999 is not in any of mini, tiny"):
        load(release, ids=["p9999"])
    with pytest.raises(ValueError, match="sample id 'nope': must be a parent 'p0123'"):
        load(release, ids=["nope"])
    with pytest.raises(ValueError, match="must be some, each of them once"):
        load(release, ids=[])


@pytest.mark.parametrize("place", ["./absent", "absent/x/y", "/absent"])
def test_a_folder_that_is_none_is_not_taken_for_something_else(place):
    with pytest.raises(FileNotFoundError, match=f"{place}: "):
        load(place)
