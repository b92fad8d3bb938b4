"""What is wrong with files, records, indexes and cards is found."""

import shutil
from dataclasses import replace

import pyarrow as pa
import pytest

from mpmworlds.builder.release.features import features_of
from mpmworlds.builder.release.layout import index_bytes, index_path, read_record
from mpmworlds.builder.release.verify import verify_release
from mpmworlds.files.checksums import write_checksums
from tests.builder.release.verify.damage import (
    RECIPES,
    TEST,
    batches_of,
    edited,
    findings_of,
    found,
)


def test_a_flipped_bit_is_found(copy):
    data = bytearray((copy / TEST).read_bytes())
    data[-300] ^= 1
    (copy / TEST).write_bytes(data)
    findings = findings_of(copy)
    assert found(findings, TEST, "its sha256 is not the one in SHA256SUMS; fetch")
    assert found(findings, TEST, "its sha256 is not the one in release.json; fetch")


def test_a_truncated_shard_is_found(copy):
    data = (copy / TEST).read_bytes()
    (copy / TEST).write_bytes(data[: len(data) // 2])
    assert found(findings_of(copy), TEST, "cannot be read")


@pytest.mark.parametrize("begin", [b"", b"\xff" * 99, b"ARROW1\0\0", bytes(64)])
def test_a_shard_of_anything_is_found(copy, begin):
    (copy / TEST).write_bytes(begin)
    assert found(findings_of(copy), TEST, "cannot be read")


def test_text_that_is_none_is_found_beside_the_checksum(copy):
    data = (copy / TEST).read_bytes()
    place = data.index(b"mpmworlds-scene/1")
    (copy / TEST).write_bytes(data[:place] + b"\xff" + data[place + 1 :])
    findings = findings_of(copy)
    assert found(findings, TEST, "its sha256 is not the one in SHA256SUMS")
    assert found(findings, TEST, "cannot be read (In column 7: Invalid: Invalid UTF8")


def test_missing_and_extra_files_are_found(copy):
    (copy / TEST).unlink()
    extra = "data/full/extra-00000-of-00001.arrow"
    (copy / extra).write_bytes(b"")
    shutil.copy(copy / RECIPES, copy / "rows.arrow")
    findings = findings_of(copy)
    assert found(findings, TEST, "is missing, SHA256SUMS names it")
    for name in (extra, "rows.arrow"):
        assert found(findings, name, "SHA256SUMS does not name it; take it away")
    write_checksums(copy)
    findings = findings_of(copy)
    assert found(findings, TEST, "is missing, release.json names it")
    assert found(findings, "data/full: p0001: ", "is missing, the lists say")
    for name in (extra, "rows.arrow"):
        assert found(findings, name, "release.json does not name it; take it away")


@pytest.mark.parametrize("name", ["README.md", "release.json", "splits/test.txt"])
def test_a_missing_part_is_found(copy, name):
    (copy / name).unlink()
    assert found(findings_of(copy), name, "is missing")
    write_checksums(copy)
    assert any("missing" in line for line in findings_of(copy))


@pytest.mark.parametrize(
    "sums", [b"nonsense\n", b"\xff\xfe\x00", b"\x1b[2J" * 5000, b"0" * 64 + b"  \xff"]
)
def test_an_unreadable_list_of_checksums_is_a_finding(copy, sums):
    (copy / "SHA256SUMS").write_bytes(sums)
    findings = findings_of(copy)
    assert findings
    assert all(line.isprintable() and len(line) < 1500 for line in findings)


@pytest.mark.parametrize(
    "record",
    [
        b"",
        b"\xff",
        b"[" * 100_000,
        b'{"dataset": "mpmworlds", "version": "\x1b[2J"}',
        b'{"dataset": "mpmworlds", "version": 3}',
    ],
)
def test_an_absurd_record_is_a_finding(copy, record):
    (copy / "release.json").write_bytes(record)
    write_checksums(copy)
    findings = findings_of(copy)
    assert found(findings, "release.json", "; ")
    assert all(line.isprintable() and len(line) < 1500 for line in findings)


def test_a_record_of_paths_elsewhere_is_a_finding(copy):
    text = (copy / "release.json").read_text()
    (copy / "release.json").write_text(text.replace(TEST, "../../../etc/passwd"))
    write_checksums(copy)
    findings = findings_of(copy)
    assert found(findings, "../../../etc/passwd", "is missing, release.json names it")
    assert found(findings, TEST, "release.json does not name it")


@pytest.mark.parametrize(
    ("key", "value", "fault"),
    [
        ("rows", 7, "has 1 rows, release.json says 7"),
        ("size", 7, "bytes, release.json says 7"),
        ("sha256", "0" * 64, "its sha256 is not the one in release.json"),
    ],
)
def test_a_record_that_says_something_else_of_a_file_is_found(copy, key, value, fault):
    edited(
        copy, lambda record: record["configs"]["full"]["files"][2].update({key: value})
    )
    assert found(findings_of(copy), TEST, fault)


def test_another_order_of_files_and_another_version_are_found(copy):
    edited(copy, lambda record: record["configs"]["full"]["files"].reverse())
    assert found(
        findings_of(copy), "release.json", "files of full must be data/full/tr"
    )
    edited(copy, lambda record: record.update(version="9.9.9"))
    assert found(findings_of(copy), "README.md", "full: version is '1.0.0', must be '9")


@pytest.mark.parametrize("data", [b"", b"\xff" * 100, "other", "recipes"])
def test_an_absurd_index_is_found(copy, data):
    path = "data/full/index.arrow"
    if data == "other":
        table = pa.table({"path": ["x"], "sha256": ["y"]})
        sink = pa.BufferOutputStream()
        with pa.ipc.new_stream(sink, table.schema) as writer:
            writer.write_table(table)
        data = bytes(sink.getvalue())
    if data == "recipes":
        data = (copy / "data/recipes/index.arrow").read_bytes()
    (copy / path).write_bytes(data)
    write_checksums(copy)
    assert found(findings_of(copy), path, "")


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"offset": 8}, "batch 2, in data/full/test-00000-of-00001.arrow: offset = 8"),
        ({"sha256": bytes(32)}, "its bytes are not those that the sha256 names"),
        ({"ids": ("p0009",)}, "ids = ['p0009'], is ['p0001']"),
    ],
)
def test_an_index_that_leads_elsewhere_is_found(copy, change, fault):
    files = read_record(copy).configs["full"].files
    parts = [(file, batches_of(copy / file.path)) for file in files]
    (batch,) = parts[2][1]
    parts[2] = (files[2], [replace(batch, **change)])
    path = index_path("full")
    (copy / path).write_bytes(index_bytes(features_of("full").arrow_schema, parts))
    write_checksums(copy)
    findings = findings_of(copy)
    assert len(findings) == 1
    assert found(findings, path, fault)


@pytest.mark.parametrize(
    ("before", "after", "fault"),
    [
        ("license: cc-by-4.0", "license: [", "its header is no YAML"),
        ("---\n", "", "has no header of YAML"),
        ("num_examples: 1", "num_examples: 5", "num_examples is 5, the record says 1"),
        ("content sha256:", "content sha256:0", "description is 'content sha256:0"),
        ("dtype: int32", "dtype: int64", "full: its features are not the columns of"),
        ("dtype: int32", "dtype: [3]", "full: its features are not the columns of"),
        ("features:\n", "features: 3\n  old:\n", "full: its features are not the col"),
        ("config_name: preview", "config_name: prview", "'prview' is only in the card"),
        ("data/full/test-*", "data/full/train-*", "full: data_files is"),
        ("- config_name: full\n", "- config_name:\n", "'full' is only in the record"),
    ],
)
def test_a_wrong_card_is_found(copy, before, after, fault):
    text = (copy / "README.md").read_text()
    assert before in text
    (copy / "README.md").write_text(text.replace(before, after))
    write_checksums(copy)
    assert found(findings_of(copy), "README.md", fault)


@pytest.mark.parametrize("data", [b"\xff---\n", b"---\n- 3\n---\n", b"---\n{" * 9999])
def test_an_absurd_card_is_found(copy, data):
    (copy / "README.md").write_bytes(data)
    write_checksums(copy)
    assert found(findings_of(copy), "README.md", "")


def test_a_folder_that_is_no_release_is_an_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        verify_release(tmp_path)
