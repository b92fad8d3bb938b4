"""A journal keeps whole lines, whatever happens, and is held by one process."""

import resource
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpmworlds.files.journal import Journal, JournalBusyError

LINES = ["alpha\n", "\n", "gamma delta\n"]
FULL = """\
import resource, sys
from pathlib import Path
from mpmworlds.files.disk import DiskFullError
from mpmworlds.files.journal import Journal
import signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
with Journal(Path(sys.argv[1])) as journal:
    resource.setrlimit(resource.RLIMIT_FSIZE, (20, 20))
    try:
        journal.append("x" * 30 + "\\n")
    except DiskFullError as error:
        print(error)
"""


def whole(path):
    with Journal(path) as journal:
        return [line.decode() for _, line, _ in journal.lines()]


def test_what_is_appended_is_read_again_in_order(tmp_path):
    path = tmp_path / "folder" / "journal"
    for line in LINES:
        with Journal(path) as journal:
            journal.append(line)
    assert whole(path) == LINES
    with Journal(path) as journal:
        assert [n for n, _, _ in journal.lines()] == [1, 2, 3]
        assert [end for _, _, end in journal.lines()][-1] == path.stat().st_size


@given(st.integers(0, len("".join(LINES))))
def test_a_torn_end_is_no_line_and_is_cut_off(tmp_path_factory, size):
    path = tmp_path_factory.mktemp("torn") / "journal"
    text = "".join(LINES)[:size]
    path.write_text(text)
    complete = text[: text.rfind("\n") + 1]
    assert whole(path) == complete.splitlines(keepends=True)
    with Journal(path) as journal:
        assert journal.end() == len(complete)
        assert journal.cut(journal.end()) == len(text) - len(complete)
        journal.append("new\n")
    assert path.read_text() == complete + "new\n"


def test_the_end_of_a_long_line_is_found(tmp_path):
    path = tmp_path / "journal"
    path.write_text("a\n" + "b" * 200_000)
    with Journal(path) as journal:
        assert journal.end() == 2


def test_a_write_that_does_not_fit_leaves_the_file_as_it_was(tmp_path):
    path = tmp_path / "journal"
    path.write_text("before\n")
    done = subprocess.run(
        [sys.executable, "-c", FULL, path], capture_output=True, text=True, check=True
    )
    assert "no room to write it (File too large)" in done.stdout
    assert str(path) in done.stdout
    assert path.read_text() == "before\n"
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] != 20


def test_a_journal_is_held_by_one_at_a_time(tmp_path):
    path = tmp_path / "journal"
    with Journal(path), pytest.raises(JournalBusyError, match="another process"):
        Journal(path)
    whole(path)
