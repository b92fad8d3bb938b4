"""Lists that differ from the rows are found."""

from mpmworlds.files.checksums import write_checksums
from mpmworlds.splits.recorded_lists import read_lists, write_lists
from tests.builder.release.verify.damage import TEST, findings_of, found


def test_a_list_that_differs_from_the_rows_is_found(copy):
    lists = read_lists(copy / "splits")
    moved = {"test": ["p0000"], "train": ["p0001", "s00"], "evaluation_test": ["p0009"]}
    write_lists(copy / "splits", lists | moved)
    write_checksums(copy)
    findings = findings_of(copy)
    for config in ("full", "full-clips", "recipes"):
        start = f"data/{config}: p0000"
        assert found(findings, start, "is missing, the lists say that it is of test")
    assert found(findings, f"{TEST}: p0001", "is there, but in no list of full and te")
    name = "splits/evaluation_test.txt"
    assert found(findings, name, "p0009 is in no row of recipes")


def test_lists_that_cannot_be_read_are_found(copy):
    (copy / "splits/test.txt").write_bytes(b"\xff\x1b[2J")
    write_checksums(copy)
    findings = findings_of(copy)
    assert found(findings, "splits", "sha256")
    assert all(line.isprintable() for line in findings)
