"""Only a lack of room is called a lack of room."""

import errno
import pickle
from pathlib import Path

import pytest

from mpmworlds.files.disk import DiskFullError, disk_errors_named


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG])
def test_no_room_is_one_error_that_names_the_file_and_the_remedy(code):
    with (
        pytest.raises(DiskFullError, match=r"out/x: no room .* free some space"),
        disk_errors_named(Path("out/x")),
    ):
        raise OSError(code, "full")


def test_a_file_that_the_error_names_itself_comes_first():
    with (
        pytest.raises(DiskFullError, match=r"^/tmp/clip\.mp4: no room"),
        disk_errors_named(Path("out/x")),
    ):
        raise OSError(errno.ENOSPC, "full", "/tmp/clip.mp4")


def test_other_errors_pass_unchanged():
    with pytest.raises(PermissionError), disk_errors_named(Path("out/x")):
        raise PermissionError(errno.EACCES, "denied")


def test_the_error_travels_between_processes():
    error = pickle.loads(pickle.dumps(DiskFullError("out/x: no room")))
    assert str(error) == "out/x: no room"
