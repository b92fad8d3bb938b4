"""The verb `export`: what it writes, goes on with, and refuses."""

import csv
import json

import cv2
import numpy as np
import pytest

from mpmworlds.loaders.load import load
from mpmworlds.loaders.weights import weights_by_kind
from mpmworlds.sim.run.encode import decode_mp4


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def export(command, release, tmp_path):
    """Function (form, folder, options) -> status, output, errors."""

    def run(form, out, *options):
        arguments = ["--release", release, "--out", tmp_path / out, "--workers", 1]
        return command("export", form, *arguments, *options)

    return run


def files_of(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def records_of(path):
    return [json.loads(line) for line in path.read_text("utf-8").splitlines()]


def test_chats_have_pictures_of_the_prefix_and_the_program(export, release, tmp_path):
    status, out, _ = export("sft", "sft", "--pictures", 3)
    assert (status, out) == (0, f"{tmp_path / 'sft'}: 5 samples of tiny/train\n")
    examples = load(release, split="train")
    records = records_of(tmp_path / "sft" / "train.jsonl")
    for record, example in zip(records, examples, strict=True):
        assert record["sample"] == example.id
        assert record["weight"] == weights_by_kind()[example.row["kind"]]
        roles = [message["role"] for message in record["messages"]]
        assert roles == ["system", "user", "assistant"]
        parts = [part for m in record["messages"] for part in m["content"]]
        assert sum(part["type"] == "image" for part in parts) == 3
        assert parts[-1]["text"] == f"```python\n{example.row['program'].strip()}\n```"
        stills = example.sampled_prefix(3)
        for place, frame in zip(record["images"], stills.frames, strict=True):
            picture = cv2.imread(str(tmp_path / "sft" / place))
            np.testing.assert_array_equal(picture[..., ::-1], frame)


def test_clips_have_texts_and_their_parts(export, release, tmp_path):
    assert export("video", "clips")[0] == 0
    folder = tmp_path / "clips" / "train"
    for record, example in zip(
        records_of(folder / "metadata.jsonl"), load(release, split="train"), strict=True
    ):
        whole, prefix, continuation = (
            decode_mp4((folder / record[name]).read_bytes())
            for name in ("file_name", "prefix_file_name", "continuation_file_name")
        )
        np.testing.assert_array_equal(prefix, example.prefix)
        np.testing.assert_array_equal(continuation, example.continuation)
        np.testing.assert_array_equal(whole, np.concatenate([prefix, continuation]))
        assert (record["prefix_frames"], record["num_frames"]) == (6, 8)
        assert record["framerate"] == 2
        assert record["text"].startswith("A video of a closed")


def test_a_table_has_what_the_lines_have(export, tmp_path):
    export("video", "lines", "--limit", 2)
    export("video", "table", "--limit", 2, "--metadata", "csv")
    lines = records_of(tmp_path / "lines" / "train" / "metadata.jsonl")
    table = (tmp_path / "table" / "train" / "metadata.csv").read_text()
    rows = list(csv.DictReader(table.splitlines()))
    assert rows == [{k: str(v) for k, v in record.items()} for record in lines]
    assert not list((tmp_path / "table").rglob("*.part"))


@pytest.mark.parametrize("form", ["sft", "video"])
def test_an_export_that_was_stopped_goes_on(form, export, tmp_path):
    export(form, "whole")
    whole = files_of(tmp_path / "whole")
    (name,) = (path for path in whole if path.endswith(".jsonl"))
    part = tmp_path / "half" / name
    export(form, "half")
    lines = part.read_bytes().splitlines(keepends=True)
    part.unlink()
    journal = part.with_name(f".{part.name}.part")
    journal.write_bytes(b"".join(lines[:2]) + lines[2][:40])
    assert export(form, "half")[0] == 0
    assert files_of(tmp_path / "half") == whole
    assert export(form, "half")[0] == 0  # there is nothing left to do


@pytest.mark.slow
def test_the_bytes_do_not_depend_on_the_number_of_processes(export, tmp_path):
    export("sft", "one", "--pictures", 2)
    export("sft", "two", "--pictures", 2, "--workers", 2)
    assert files_of(tmp_path / "one") == files_of(tmp_path / "two")


def test_another_export_in_the_folder_is_refused(export, tmp_path):
    export("sft", "out", "--pictures", 2)
    status, _, err = export("sft", "out", "--pictures", 3)
    assert status == 2
    assert "holds an export of pictures = 2; name another folder" in err


@pytest.mark.parametrize(
    ("form", "options", "message"),
    [
        ("video", ["--pictures", 3], "--pictures: is no option of video"),
        ("sft", ["--metadata", "csv"], "--metadata: is no option of sft"),
        ("sft", ["--pictures", 1], "n = 1 frames, must be at least 2"),
        ("sft", ["--limit", 0], "limit = 0, must be at least 1"),
        ("sft", ["--workers", -1], "workers = -1, must be >= 0"),
        ("sft", ["--regime", "all"], "regime 'all': unknown"),
        ("sft", ["--config", "recipes"], "has no video"),
    ],
    ids=lambda value: str(value) if isinstance(value, list) else None,
)
def test_impossible_exports_say_what_to_do(form, options, message, export):
    status, out, err = export(form, "out", *options)
    assert (status, out) == (2, "")
    assert message in err
