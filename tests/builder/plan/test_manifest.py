"""A manifest is read back as written, byte-stable, and refused when it is not one."""

from dataclasses import replace

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from mpmworlds.builder.plan.manifest import (
    SCHEMA,
    ManifestError,
    read_manifest,
    read_table,
    write_manifest,
)


def test_rows_are_read_back_as_written(corpus):
    assert read_manifest(corpus.manifest) == corpus.rows


def test_bytes_are_the_same_every_time(corpus, tmp_path):
    write_manifest(tmp_path / "again.parquet", corpus.rows)
    assert (tmp_path / "again.parquet").read_bytes() == corpus.manifest.read_bytes()


def test_an_empty_manifest_is_one(tmp_path):
    write_manifest(tmp_path / "new" / "empty.parquet", [])
    assert read_manifest(tmp_path / "new" / "empty.parquet") == []


def test_columns_that_are_missing_unknown_or_of_another_type_are_named(
    corpus, tmp_path
):
    table = pq.read_table(corpus.manifest).drop_columns("scene")
    table = table.append_column("mood", pa.array(["calm"] * len(table)))
    index = table.schema.get_field_index("num_objects")
    table = table.set_column(index, "num_objects", pa.array(["3"] * len(table)))
    pq.write_table(table, tmp_path / "m.parquet")
    with pytest.raises(ManifestError) as error:
        read_manifest(tmp_path / "m.parquet")
    assert "column 'scene' is missing" in str(error.value)
    assert "column 'mood' is unknown" in str(error.value)
    assert "column 'num_objects' is string, must be int32" in str(error.value)


@pytest.mark.parametrize("read", [read_manifest, read_table])
def test_a_file_of_another_format_is_refused(read, tmp_path):
    (tmp_path / "m.parquet").write_text("id,kind\n")
    with pytest.raises(ManifestError, match="no readable Parquet file"):
        read(tmp_path / "m.parquet")


def test_some_columns_are_read_without_the_others(corpus):
    table = read_table(corpus.manifest, ["split", "id"])
    assert set(table.column_names) == {"id", "split"}
    assert table["id"].to_pylist() == [row.id for row in corpus.rows]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"id": "p0001"}, "occurs twice"),
        ({"kind": "cousin"}, "must be one of seed, parent, child, perturbation"),
        ({"scene": "another: scene\n"}, "scene_sha256 says"),
    ],
)
def test_rows_that_contradict_themselves_are_not_written(
    corpus, tmp_path, change, message
):
    rows = [*corpus.rows[1:], replace(corpus.rows[0], **change)]
    with pytest.raises(ManifestError, match=message):
        write_manifest(tmp_path / "m.parquet", rows)
    assert list(tmp_path.iterdir()) == []


def test_a_scene_that_was_changed_in_the_file_is_noticed(corpus, tmp_path):
    records = pq.read_table(corpus.manifest).to_pylist()
    records[2]["scene"] += " "
    table = pa.Table.from_pylist(records, schema=SCHEMA)
    pq.write_table(table, tmp_path / "m.parquet")
    with pytest.raises(ManifestError, match=r"row 'p0000-c0-n00': the scene's sha256"):
        read_manifest(tmp_path / "m.parquet")
