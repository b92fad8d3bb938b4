"""Rows that are there twice, not at all, or elsewhere are found."""

from pathlib import Path

import pytest

from tests.builder.release.verify.damage import (
    TEST,
    TRAIN,
    edited,
    findings_of,
    fix_up,
    found,
    rows_of,
    write_rows,
)


@pytest.mark.parametrize("sums", ["stale", "fixed up"])
@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (lambda rows: rows * 2, "is there twice, also in"),
        (lambda rows: [], "is missing, the lists say that it is of test"),
    ],
)
def test_rows_that_are_dropped_or_doubled_are_found(copy, change, fault, sums):
    write_rows(copy / TEST, change(rows_of(copy / TEST)))
    if sums == "fixed up":
        fix_up(copy)
    findings = findings_of(copy)
    assert any("p0001: " in line and fault in line for line in findings), findings


def test_a_configuration_that_has_lost_all_files_is_found(copy):
    for path in (copy / "data/full-clips").glob("t*.arrow"):
        path.unlink()
    edited(copy, lambda record: record["configs"]["full-clips"].update(files=[]))
    findings = findings_of(copy)
    assert found(findings, "data/full-clips: p0001: ", "is missing, the lists say")


def swap(copy, one, other):
    first, second = (copy / one).read_bytes(), (copy / other).read_bytes()
    (copy / one).write_bytes(second)
    (copy / other).write_bytes(first)


@pytest.mark.parametrize("sums", ["stale", "fixed up"])
@pytest.mark.parametrize("config", ["full", "full-clips", "preview", "recipes"])
def test_swapped_files_of_two_splits_are_found(copy, config, sums):
    one, other = TEST, TRAIN[1]
    if config == "recipes":
        other = "data/recipes/train-00000-of-00001.arrow"
    one, other = (Path("data", config, Path(name).name) for name in (one, other))
    swap(copy, one, other)
    if sums == "fixed up":
        fix_up(copy)
    findings = findings_of(copy)
    assert found(findings, f"{one}: p0000", "split = 'train', in a file of 'test'")
    assert found(findings, f"{other}: p0001", "split = 'test', in a file of 'train'")


def test_swapped_files_of_a_split_are_found(copy):
    swap(copy, *TRAIN)
    findings = findings_of(copy)
    for name in TRAIN:
        assert found(findings, name, "its sha256 is not the one in")
    fix_up(copy)
    (finding,) = findings_of(copy)
    assert finding == (
        f"{TRAIN[1]}: s00: comes later than in recipes; rows or files were swapped; "
        "fetch or build the release again"
    )
