"""The log of a store tells what rendering took, whatever became of its writers."""

import pytest

from mpmworlds.builder.render.timings import (
    LOG,
    Timing,
    append_timing,
    estimate,
    read_timings,
)

SAND = Timing("p0000", "a" * 64, 8.0, 2.0, 1000)
SNOW = Timing("p0001", "b" * 64, 18.0, 2.0, 2000)
OTHER = Timing("p0000", "c" * 64, 1.0, 0.5, 10)


@pytest.fixture
def root(tmp_path):
    for timing in (SAND, SNOW, OTHER):
        append_timing(tmp_path, timing)
    return tmp_path


def test_timings_come_back_in_order(root):
    assert read_timings(root) == [SAND, SNOW, OTHER]


@pytest.mark.parametrize("end", ['{"id": "p00', "null\n", '{"id": "p0"}\n', "\xff\n"])
def test_lines_that_are_no_timings_do_not_count(root, end):
    with (root / LOG).open("a", encoding="latin-1") as log:
        log.write(end)
    assert read_timings(root) == [SAND, SNOW, OTHER]


def test_estimate_is_the_mean_of_the_programs_in_question(root):
    found = estimate(10, root, {SAND.program_sha256, SNOW.program_sha256, "d" * 64})
    assert (found.measured, found.core_seconds, found.bytes) == (2, 150.0, 15000)
    assert found.summary(3)["seconds"] == 50.0


def test_there_is_no_estimate_without_a_measurement(root, tmp_path):
    assert estimate(10, root, {"d" * 64}) is None
    assert estimate(10, tmp_path / "absent", {SAND.program_sha256}) is None
