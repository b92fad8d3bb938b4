"""The verb that renders rows of a manifest: which rows, where to, and what it says."""

import json
import shutil
from dataclasses import replace

import pytest

from mpmworlds.builder.plan import manifest
from mpmworlds.builder.plan.manifest import read_manifest, write_manifest
from mpmworlds.builder.render import materialise
from mpmworlds.builder.render.materialise import Failure, Materialised
from mpmworlds.files.checksums import files_below
from mpmworlds.files.locks import hold
from tests.small import IDS


def test_materialise_records_the_hashes_of_all_videos(command, small, tmp_path):
    record = tmp_path / "record.jsonl"
    options = ["--manifest", small.manifest, "--store", small.store]
    status, out, err = command("materialise", *options, "--record", record)
    assert (status, out) == (0, "")
    assert "0 rendered, 2 there before, 0 failed" in err
    lines = [json.loads(line) for line in record.read_text().splitlines()]
    assert [line["id"] for line in lines] == IDS
    rows = {row.id: row for row in read_manifest(small.manifest)}
    for line in lines:
        assert line["program_sha256"] == rows[line["id"]].program_sha256
        assert (line["num_frames"], line["resolution"]) == (80, 64)


def test_manifest_of_another_version_is_not_rendered(command, small, tmp_path):
    rows = read_manifest(small.manifest)
    path = tmp_path / "manifest.parquet"
    write_manifest(path, [replace(rows[0], program_sha256="0" * 64)])
    status, out, err = command(
        "materialise", "--manifest", path, "--store", tmp_path / "store"
    )
    assert (status, out) == (2, "")
    assert "p0000: the linked program's sha256 is " in err
    assert "plan it again or use that version" in err


@pytest.mark.parametrize("verb", ["materialise", "build"])
def test_failed_scene_is_named_and_nothing_is_made_of_the_rest(
    verb, command, small, tmp_path, monkeypatch
):
    failures = [Failure(f"p000{n}", "crash", "ended by SIGSEGV") for n in range(2)]
    done = Materialised(1, 0, tuple(failures))
    monkeypatch.setattr(materialise, "materialise", lambda *_: done)
    out = tmp_path / "out"
    status, printed, err = command(
        *(verb, "--manifest", small.manifest, "--store", small.store),
        *("--record" if verb == "materialise" else "--out", out),
    )
    assert (status, printed) == (1, "")
    assert "1 rendered, 0 there before, 2 failed" in err
    assert "crash: 2 failed, such as p0000: ended by SIGSEGV" in err
    assert not out.exists()


@pytest.fixture
def ask(command, small):
    """Return a function: arguments of materialise -> status, output, messages."""
    places = ["--manifest", small.manifest, "--store", small.store]
    return lambda *options: command("materialise", *options, *places)


@pytest.mark.parametrize(
    ("options", "ids"),
    [
        ([], IDS),
        (["s04"], ["s04"]),
        (["s04", "p0000"], IDS),
        (["--split", "test"], ["p0000"]),
        (["--kind", "seed"], ["s04"]),
        (["--where", "kind = 'seed' or num_objects > 99"], ["s04"]),
        (["--limit", "1"], ["p0000"]),
        (["--sample", "2", "--limit", "1", "--split", "train"], ["s04"]),
    ],
    ids=str,
)
def test_selection_chooses_the_rows(options, ids, ask):
    assert ask("--list-ids", *options) == (0, "".join(f"{i}\n" for i in ids), "")


def test_ids_come_from_a_file_as_well(ask, tmp_path):
    path = tmp_path / "ids.txt"
    path.write_text("s04\n")
    assert ask("--list-ids", "--ids", path) == (0, "s04\n", "")
    path.write_text("\n")
    status, out, err = ask("--list-ids", "--ids", path)
    assert (status, out) == (2, "")
    assert f"{path}: holds no ids" in err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["s05"], "not in the manifest: 's05' (nearest: s04)"),
        (["--split", "exam"], "split 'exam': there are test, train"),
        (["--where", "num_object > 1"], '"num_object" not found'),
        (["--limit", "0"], "limit = 0, must be at least 1"),
        (["s04", "--split", "test"], "none of the 2 rows satisfies all that is asked"),
        (["--workers", "-1"], "workers = -1, must be >= 0"),
    ],
    ids=str,
)
def test_impossible_selection_is_wrong_use(options, message, ask):
    status, out, err = ask(*options)
    assert (status, out) == (2, "")
    assert message in err


def test_to_render_everything_must_be_asked_for(command):
    status, out, err = command("materialise")
    assert (status, out) == (2, "")
    assert "what to render? Name ids, select with --split" in err
    assert "say --config full for the whole corpus" in err


def test_none_of_them_is_no_selection(command):
    status, _, err = command("materialise", "--sample", "0")
    assert (status, "sample = 0, must be" in err) == (2, True)


def test_ids_alone_are_of_the_full_corpus(command):
    asked = ["p0123-c4", "s07", "--list-ids"]
    assert command("materialise", *asked) == (0, "p0123-c4\ns07\n", "")


def test_corpus_without_a_recorded_manifest_says_what_to_do(command):
    status, out, err = command("materialise", "--config", "grand")
    assert (status, out) == (2, "")
    assert "there is no recorded manifest of 'grand'" in err
    assert "mpmworlds plan --config grand --out FILE" in err


def test_recorded_manifest_is_the_default(command, small, tmp_path, monkeypatch):
    (tmp_path / "recorded").mkdir()
    copy = tmp_path / "recorded" / "grand.parquet"
    copy.write_bytes(small.manifest.read_bytes())
    monkeypatch.setattr(manifest, "files", lambda _: tmp_path)
    options = ["--config", "grand", "--list-ids"]
    assert command("materialise", *options) == (0, "p0000\ns04\n", "")
    _, _, err = command("materialise", "--config", "grander")
    assert "of 'grander', only of ['grand']" in err


def test_dry_run_tells_what_is_there_and_what_the_rest_would_take(
    command, ask, small, tmp_path
):
    assert ask("--dry-run") == (0, "2 selected, 2 in the store, 0 to render\n", "")
    store = tmp_path / "store"
    options = ["--dry-run", "--manifest", small.manifest, "--store", store]
    status, out, _ = command("materialise", *options)
    assert (status, out.splitlines()[0]) == (
        0,
        "2 selected, 0 in the store, 2 to render",
    )
    assert "no estimate: render a few of these rows first" in out
    assert not store.exists()
    store.mkdir()
    log = (small.store / "log.jsonl").read_text()
    (store / "log.jsonl").write_text(log)
    size = sum(json.loads(line)["bytes"] for line in log.splitlines())
    status, out, _ = command("materialise", *options, "--workers", "3")
    assert "with 3 at a time" in out
    assert f"and {size / 1e6:.1f} MB, judging by 2 rendered rows" in out
    status, out, _ = command("materialise", *options, "--workers", "4", "--json")
    answer = json.loads(out)
    assert (answer["selected"], answer["in_store"], answer["to_render"]) == (2, 0, 2)
    assert (answer["measured"], answer["bytes"]) == (2, size)
    assert answer["seconds"] == answer["core_seconds"] / 4


def test_summary_is_readable_by_a_program(ask):
    status, out, _ = ask("--json", "s04")
    assert status == 0
    assert json.loads(out) | {"seconds": 0} == {
        "rendered": 0,
        "reused": 1,
        "failed": 0,
        "failures": {},
        "simulation_seconds": 0,
        "encoding_seconds": 0,
        "seconds": 0,
        "bytes": 0,
    }


def test_failures_go_where_they_are_told(ask, tmp_path):
    status, _, _ = ask("s04", "--failures", tmp_path / "new" / "f.jsonl")
    assert status == 0
    assert (tmp_path / "new" / "f.jsonl").read_text() == ""


@pytest.mark.slow
def test_a_cluster_renders_the_same_bits(command, small, tmp_path):
    pytest.importorskip("ray", reason="Ray is not installed (the extra [cluster])")
    store = tmp_path / "store"
    status, out, err = command(
        *("materialise", "--manifest", small.manifest, "--store", store),
        *("--ray", "local", "--workers", "2", "--json"),
    )
    assert (status, json.loads(out)["rendered"]) == (0, 2), err
    entries = [name for name in files_below(small.store) if "/" in name]
    assert len(entries) == 8
    assert {n: (store / n).read_bytes() for n in entries} == {
        n: (small.store / n).read_bytes() for n in entries
    }


def test_runs_on_one_store_have_a_file_of_failures_each(command, small, tmp_path):
    store = tmp_path / "store"
    shutil.copytree(small.store, store)
    (store / "failures.jsonl").write_text("of the other run\n")
    options = ["--manifest", small.manifest, "--store", store]
    with hold(store / ".failures.jsonl.lock"):
        assert command("materialise", *options)[0] == 0
        assert (store / "failures.jsonl").read_text() == "of the other run\n"
        assert (store / "failures-2.jsonl").read_text() == ""
        named = ["--failures", store / "failures.jsonl"]
        status, _, err = command("materialise", *options, *named)
        assert (status, "another run writes it; name another" in err) == (2, True)
    assert command("materialise", *options)[0] == 0
    assert (store / "failures.jsonl").read_text() == ""
    assert not list(store.glob(".*.lock"))
