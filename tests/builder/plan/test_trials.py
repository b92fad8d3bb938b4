"""No finding of a trial is lost, and the same findings are the same file."""

import resource
import subprocess
import sys

import pytest

from mpmworlds.builder.plan.screen import Findings
from mpmworlds.builder.plan.trials import (
    append_journal,
    read_journal,
    read_recorded,
    write_recorded,
)
from mpmworlds.files.disk import DiskFullError

FOUND = {
    "b": Findings("ok", 64, 912, 0, 0.1234, 1.5e-05, 0.71, 0.25),
    "a": Findings("timeout"),
    "c": Findings("ok", matter=1, lost=3, travel=float("inf")),
}
ONE, OTHER = {"b": FOUND["b"]}, {"a": FOUND["a"], "c": FOUND["c"]}


@pytest.fixture
def journal(tmp_path):
    return tmp_path / "folder" / "trials.jsonl"


# ---- the journal


def test_a_journal_gives_back_what_was_added_to_it(journal):
    assert read_journal(journal) == {}
    append_journal(journal, ONE)
    append_journal(journal, OTHER)
    assert read_journal(journal) == FOUND
    assert journal.read_bytes().count(b"\n") == 3


def test_a_later_finding_takes_the_place_of_an_earlier_one(journal):
    append_journal(journal, {"a": FOUND["b"]})
    append_journal(journal, {"a": FOUND["a"]})
    assert read_journal(journal) == {"a": FOUND["a"]}


@pytest.mark.parametrize("left", [1, 30, -1])
def test_a_line_that_was_cut_off_does_not_count_and_gives_way_to_the_next(
    journal, left
):
    append_journal(journal, ONE)
    whole = journal.read_bytes()
    append_journal(journal, OTHER)
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(whole + lines[1][:left])
    assert read_journal(journal) == ONE
    append_journal(journal, OTHER)
    assert journal.read_bytes() == b"".join(lines)


def test_a_journal_of_one_line_that_was_cut_off_is_empty(journal):
    journal.parent.mkdir()
    journal.write_bytes(b'{"key": "a", "sta')
    assert read_journal(journal) == {}
    append_journal(journal, ONE)
    assert read_journal(journal) == ONE


FILL = """
import sys
from pathlib import Path
from mpmworlds.builder.plan.screen import Findings
from mpmworlds.builder.plan.trials import append_journal
try:
    found = {str(n): Findings("ok") for n in range(int(sys.argv[2]))}
    append_journal(Path(sys.argv[1]), found)
except OSError as error:
    print(type(error).__name__, error)
"""


@pytest.mark.parametrize("count", [3, 500])
def test_what_does_not_fit_on_the_disk_loses_nothing_and_can_be_added_later(
    journal, count
):
    append_journal(journal, ONE)
    limit = journal.stat().st_size + 100
    done = subprocess.run(
        [sys.executable, "-c", FILL, str(journal), str(count)],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.startswith(DiskFullError.__name__), done.stderr
    assert "no room to write it" in done.stdout
    assert read_journal(journal) == ONE
    append_journal(journal, OTHER)
    assert read_journal(journal) == FOUND


# ---- the recorded table


def test_a_table_gives_back_what_was_recorded(tmp_path):
    path = tmp_path / "folder" / "trials.parquet"
    with pytest.raises(FileNotFoundError):
        read_recorded([path])
    write_recorded(path, FOUND)
    assert read_recorded([path]) == FOUND
    assert list(read_recorded([path])) == ["a", "b", "c"]


def test_a_table_is_the_same_file_whatever_the_order(tmp_path):
    one, other = tmp_path / "one", tmp_path / "other"
    write_recorded(one, FOUND)
    write_recorded(other, dict(reversed(FOUND.items())))
    assert one.read_bytes() == other.read_bytes()


def test_a_table_may_be_empty(tmp_path):
    write_recorded(tmp_path / "none", {})
    assert read_recorded([tmp_path / "none"]) == {}
