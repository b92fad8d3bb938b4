"""A release has the same bytes however it came about, or it does not come about."""

import hashlib
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest

from mpmworlds.builder.plan.manifest import read_manifest, text_sha256, write_manifest
from mpmworlds.builder.release.build import build_release
from mpmworlds.builder.release.layout import Index, index_path
from mpmworlds.builder.release.mpmworlds import (
    BATCH_ROWS,
    MPMWorlds,
    NotRenderedError,
)
from mpmworlds.builder.release.shards import Corpus, ReleaseError, plan_shards
from mpmworlds.builder.render.store import Store
from mpmworlds.files.locks import hold
from mpmworlds.metrics.reduction import reduce_clip
from mpmworlds.sim.run.encode import decode_mp4

CONFIGS = {"tiny": None, "mini": ["p0000", "p0002"]}
COMMAND = """
import sys, signal
from pathlib import Path
from mpmworlds.builder.release.build import build_release
from mpmworlds.builder.release.shards import Corpus
from mpmworlds.builder.render.store import Store
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
configs = {"tiny": None, "mini": ["p0000", "p0002"]}
build_release([Corpus(Path(sys.argv[1]), configs, rows_per_shard=2)],
              Store(Path(sys.argv[2])), Path(sys.argv[3]), version="1.2.3")
"""


def build(corpus, out, configs=CONFIGS, rows_per_shard=2, **changes):
    planned = Corpus(corpus.manifest, configs, rows_per_shard=rows_per_shard)
    store, arguments = corpus.store, {"version": "1.2.3"} | changes
    return build_release([planned], store, out, **arguments)


def tree(folder):
    """Return the bytes of all files below a folder by their relative path."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(files)}


@pytest.fixture
def copied_store(corpus, tmp_path):
    """A store that may be damaged."""
    shutil.copytree(corpus.store.root, tmp_path / "store")
    return Store(tmp_path / "store")


def video_of(store, row):
    """Path of a row's video in a store."""
    for path in store.root.rglob("*.json"):
        if row.program_sha256 in path.read_text():
            return path.with_suffix(".mp4")
    raise LookupError(row.id)


def test_the_folder_holds_what_was_planned_and_nothing_else(release):
    assert sorted(tree(release)) == [
        "README.md",
        "SHA256SUMS",
        "croissant.json",
        "data/mini/index.arrow",
        "data/mini/test-00000-of-00001.arrow",
        "data/mini/train-00000-of-00001.arrow",
        "data/recipes/index.arrow",
        "data/recipes/modification_validation-00000-of-00001.arrow",
        "data/recipes/test-00000-of-00001.arrow",
        "data/recipes/train-00000-of-00001.arrow",
        "data/tiny/index.arrow",
        "data/tiny/modification_validation-00000-of-00001.arrow",
        "data/tiny/test-00000-of-00001.arrow",
        "data/tiny/train-00000-of-00003.arrow",
        "data/tiny/train-00001-of-00003.arrow",
        "data/tiny/train-00002-of-00003.arrow",
        "release.json",
        "splits/SHA256SUMS",
        "splits/modification_validation.txt",
        "splits/test.txt",
        "splits/train.txt",
    ]
    assert {path.name for path in release.iterdir() if path.name[0] == "."} == set()


def test_checksums_are_those_of_sha256sum(release):
    command = ["sha256sum", "--check", "--quiet", "SHA256SUMS"]
    subprocess.run(command, cwd=release, check=True)


def test_bytes_do_not_depend_on_the_number_of_processes(corpus, release, tmp_path):
    build(corpus, tmp_path / "again", workers=2)
    assert tree(tmp_path / "again") == tree(release)


def test_shards_are_what_the_datasets_writer_writes(corpus, release, tmp_path):
    planned = plan_shards(Corpus(corpus.manifest).rows(), {"tiny": None}, 2)
    builder = MPMWorlds(
        config_name="tiny",
        shards={"test": [s.rows for s in planned if s.split == "test"]},
        store=corpus.store.root,
        cache_dir=str(tmp_path / "cache"),
    )
    builder.download_and_prepare(str(tmp_path / "out"))
    (written,) = (tmp_path / "out").glob("*.arrow")
    expected = release / "data/tiny/test-00000-of-00001.arrow"
    assert written.read_bytes() == expected.read_bytes()

    from datasets.arrow_writer import ArrowWriter

    reference = tmp_path / "reference.arrow"
    writer = ArrowWriter(
        path=str(reference),
        features=builder.info.features,
        writer_batch_size=BATCH_ROWS,
    )
    for row in builder.as_dataset("test"):
        writer.write(builder.info.features.encode_example(row))
    writer.finalize()
    writer.close()
    assert written.read_bytes() == reference.read_bytes()


def test_building_again_over_a_release_gives_the_same_bytes(corpus, release, tmp_path):
    build(corpus, tmp_path / "twice", rows_per_shard=1)
    build(corpus, tmp_path / "twice")
    assert tree(tmp_path / "twice") == tree(release)


def test_a_build_that_was_killed_goes_on_where_it_stopped(
    corpus, release, copied_store, tmp_path
):
    blocked = video_of(copied_store, corpus.rows[-1])
    whole = blocked.with_suffix(".whole")
    blocked.rename(whole)
    os.mkfifo(blocked)  # a reader of it waits for ever
    out = tmp_path / "out"
    arguments = [str(corpus.manifest), str(copied_store.root), str(out)]
    process = subprocess.Popen([sys.executable, "-c", COMMAND, *arguments])
    name = "data/tiny/modification_validation-00000-of-00001.arrow"
    staged, finished = out / ".build" / name, out / name
    note = staged.with_suffix(".json")
    deadline = time.monotonic() + 60
    while not note.exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    assert not (out / "SHA256SUMS").exists()
    (out / ".build/data/tiny/test-00000-of-00001.part").write_bytes(b"half")
    (out / "splits").mkdir()
    (out / "splits/.train.txt.77.part").write_bytes(b"half")
    blocked.unlink()
    whole.rename(blocked)
    before = staged.stat().st_mtime_ns
    build(corpus, out)
    assert finished.stat().st_mtime_ns == before
    assert tree(out) == tree(release)


def test_a_finished_shard_that_was_truncated_is_written_again(
    corpus, release, copied_store, tmp_path
):
    video = video_of(copied_store, corpus.rows[-1])
    whole = video.read_bytes()
    video.unlink()
    with pytest.raises(NotRenderedError, match=r"p0002-n00: .* materialise"):
        build_release(
            [Corpus(corpus.manifest, CONFIGS, rows_per_shard=2)],
            copied_store,
            tmp_path / "out",
            version="1.2.3",
        )
    shard = tmp_path / "out/.build/data/tiny/train-00000-of-00003.arrow"
    os.truncate(shard, 500)
    video.write_bytes(whole)
    build(corpus, tmp_path / "out")
    assert tree(tmp_path / "out") == tree(release)


def test_a_corrupt_video_in_the_store_stops_the_build(corpus, copied_store, tmp_path):
    video = video_of(copied_store, corpus.rows[0])
    data = bytearray(video.read_bytes())
    data[len(data) // 2] ^= 1
    video.write_bytes(data)
    with pytest.raises(NotRenderedError, match=r"p0000: .* is corrupt there"):
        build_release(
            [Corpus(corpus.manifest, CONFIGS)],
            copied_store,
            tmp_path / "out",
            version="1.0.0",
        )


def test_a_full_disk_is_a_clear_error_and_the_next_build_goes_on(
    corpus, release, tmp_path
):
    sizes = sorted(path.stat().st_size for path in release.glob("data/*/*.arrow"))
    limit = sizes[len(sizes) // 2]
    out = tmp_path / "out"
    arguments = [str(corpus.manifest), str(corpus.store.root), str(out)]
    done = subprocess.run(
        [sys.executable, "-c", COMMAND, *arguments],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert "DiskFullError" in done.stderr
    assert "free some space and run the same command again" in done.stderr
    assert list(out.rglob("*.part")) == []
    assert not (out / "SHA256SUMS").exists()
    build(corpus, out)
    assert tree(out) == tree(release)


def test_a_configuration_that_comes_later_leaves_the_others_alone(
    corpus, release, tmp_path
):
    out = tmp_path / "out"
    first = build(corpus, out, {"tiny": None})
    assert (first.added, first.kept) == (("tiny", "recipes"), ())
    before = tree(out / "data/tiny") | tree(out / "data/recipes")
    times = {p: p.stat().st_mtime_ns for p in (out / "data").rglob("*.arrow")}
    later = build(corpus, out, {"mini": CONFIGS["mini"], "tiny-clips": ["p0001"]})
    assert later.added == ("mini", "tiny-clips")
    assert (later.unchanged, later.kept) == (("recipes",), ("tiny",))
    assert tree(out / "data/tiny") | tree(out / "data/recipes") == before
    assert all(path.stat().st_mtime_ns == at for path, at in times.items())
    assert later.record.default == "tiny"
    assert tree(out / "data/mini") == tree(release / "data/mini")
    command = ["sha256sum", "--check", "--quiet", "SHA256SUMS"]
    subprocess.run(command, cwd=out, check=True)


def test_what_is_replaced_is_said_and_leaves_nothing_behind(corpus, tmp_path):
    out = tmp_path / "out"
    build(corpus, out, rows_per_shard=1)
    built = build(corpus, out, {"tiny": ["p0001"]}, rows_per_shard=1)
    assert (built.replaced, built.unchanged) == (("tiny",), ("recipes",))
    names = sorted(path.name for path in (out / "data/tiny").iterdir())
    assert names == ["index.arrow", "train-00000-of-00001.arrow"]
    assert build(corpus, out, {"tiny": ["p0001"]}).unchanged == ("tiny", "recipes")


def test_a_release_stays_whole_until_an_addition_is_done(
    corpus, copied_store, tmp_path
):
    out = tmp_path / "out"
    build(corpus, out, {"mini": ["p0000"]})
    before = tree(out)
    video_of(copied_store, corpus.rows[-1]).unlink()
    with pytest.raises(NotRenderedError):
        build_release(
            [Corpus(corpus.manifest, {"tiny": None})],
            copied_store,
            out,
            version="1.2.3",
        )
    left = {n: b for n, b in tree(out).items() if not n.startswith(".build")}
    assert left == before
    build(corpus, out, {"tiny": None})
    assert not (out / ".build").exists()


def test_what_goes_together_is_of_one_version_and_one_plan(corpus, tmp_path):
    out = tmp_path / "out"
    build(corpus, out, {"mini": ["p0000"]})
    with pytest.raises(
        ReleaseError, match=r"has mini of 1\.2\.3, .* is of 1\.3\.0; .*--config mini"
    ):
        build(corpus, out, {"tiny": None}, version="1.3.0")
    rows = [replace(corpus.rows[0], edit="{}"), *corpus.rows[1:]]
    write_manifest(tmp_path / "m", rows)
    planned = Corpus(tmp_path / "m", {"tiny": None})
    with pytest.raises(ReleaseError, match="mini is of another plan of 'full'"):
        build_release([planned], corpus.store, out, version="1.2.3")


def test_a_clip_is_the_reduced_video(corpus, tmp_path):
    import datasets

    out = tmp_path / "out"
    build(corpus, out, {"tiny": None, "tiny-clips": None})
    for config in ("tiny", "tiny-clips"):
        file = out / f"data/{config}/test-00000-of-00001.arrow"
        for row in datasets.Dataset.from_file(str(file)):
            assert ("video" in row) == (config == "tiny")
            frames = reduce_clip(corpus.frames[row["id"]], row["framerate"])
            np.testing.assert_array_equal(decode_mp4(row["clip"]["bytes"]), frames)


def test_the_index_tells_where_each_row_lies_and_what_its_bytes_are(release):
    for config in ("tiny", "recipes"):
        path = index_path(config)
        index = Index((release / path).read_bytes(), path)
        places = index.places()
        assert len(places) == 8
        for sample, (number, row) in places.items():
            file, batch = index.at(number)
            with (release / file).open("rb") as stream:
                stream.seek(batch.offset)
                data = stream.read(batch.size)
            assert hashlib.sha256(data).digest() == batch.sha256
            found = pa.ipc.read_record_batch(pa.py_buffer(data), index.schema)
            assert found.column("id")[row].as_py() == sample


def test_a_folder_with_other_things_in_it_is_left_alone(corpus, tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(ReleaseError, match=r"holds 'thesis.tex', which is no part"):
        build(corpus, tmp_path)
    assert tree(tmp_path) == {"thesis.tex": b"years of work"}


@pytest.mark.parametrize("finished", [True, False])
def test_what_was_put_into_a_release_is_left_alone(corpus, release, tmp_path, finished):
    out = shutil.copytree(release, tmp_path / "out")
    if not finished:
        (out / "SHA256SUMS").unlink()
        (out / ".build").mkdir()
        (out / ".build/mpmworlds").write_text("ours")
    (out / "thesis.tex").write_text("years of work")
    before = tree(out)
    with pytest.raises(ReleaseError, match=r"holds 'thesis.tex', which is no part"):
        build(corpus, out)
    assert tree(out) == before


def test_checksums_of_something_else_make_no_release(corpus, release, tmp_path):
    out = shutil.copytree(release / "splits", tmp_path / "out")
    before = tree(out)
    with pytest.raises(ReleaseError, match=r"holds 'SHA256SUMS', which is no part"):
        build(corpus, out)
    assert tree(out) == before


def test_a_release_that_is_being_built_is_left_alone(corpus, release, tmp_path):
    out = shutil.copytree(release, tmp_path / "out")
    busy = pytest.raises(ReleaseError, match="another process is building it")
    with hold(tmp_path / ".out.lock"), busy:
        build(corpus, out)
    assert tree(out) == tree(release)


def test_rows_keep_the_order_of_the_manifest_and_every_row_is_in_one_shard(corpus):
    rows = Corpus(corpus.manifest).rows()
    plan = plan_shards(rows, {"tiny": None, "recipes": None}, rows_per_shard=3)
    for config in ("tiny", "recipes"):
        for split in ("train", "modification_validation", "test"):
            shards = [s for s in plan if (s.config, s.split) == (config, split)]
            ids = [i for shard in shards for i in shard.rows["id"].to_pylist()]
            assert ids == [row.id for row in corpus.rows if row.split == split]
            assert all(len(shard.rows) <= 3 or config == "recipes" for shard in shards)


def test_the_key_of_a_shard_depends_on_every_value_of_its_rows(corpus, tmp_path):
    configs = {"tiny": None, "recipes": None}

    def keys(rows):
        write_manifest(tmp_path / "m", rows)
        planned = plan_shards(Corpus(tmp_path / "m").rows(), configs, 10)
        return [shard.key for shard in planned]

    changed = [replace(corpus.rows[0], edit="{}"), *corpus.rows[1:]]
    same = [a == b for a, b in zip(keys(corpus.rows), keys(changed), strict=True)]
    assert same == [False, True, True, False, True, True]


@pytest.mark.parametrize(
    ("configs", "rows_per_shard", "message"),
    [
        ({}, 1, "must be at least one"),
        ({"recipes": None}, 1, "is added to every release"),
        ({"tiny": None}, 0, "rows_per_shard = 0"),
        ({"tiny": ["p0000", "p9999", "p9998"]}, 1, "p9998 and 1 more ids"),
    ],
)
def test_a_plan_that_makes_no_sense_is_refused(
    corpus, tmp_path, configs, rows_per_shard, message
):
    with pytest.raises(ReleaseError, match=message):
        build(corpus, tmp_path / "out", configs, rows_per_shard)
    assert not (tmp_path / "out").exists()


def test_a_split_that_is_unknown_is_refused(corpus, tmp_path):
    rows = [replace(corpus.rows[0], split="validation"), *corpus.rows[1:]]
    write_manifest(tmp_path / "m.parquet", rows)
    with pytest.raises(ReleaseError, match="p0000: split = 'validation', must be one"):
        build_release(
            [Corpus(tmp_path / "m.parquet", CONFIGS)],
            corpus.store,
            tmp_path / "out",
            version="1.0.0",
        )


def test_programs_in_the_release_are_those_of_the_manifest(corpus, release):
    import datasets

    table = datasets.Dataset.from_file(
        str(release / "data/tiny/test-00000-of-00001.arrow")
    )
    rows = {row.id: row for row in read_manifest(corpus.manifest)}
    for record in table:
        assert text_sha256(record["program"]) == rows[record["id"]].program_sha256
        assert record["video"]["path"] == f"{record['id']}.mp4"
