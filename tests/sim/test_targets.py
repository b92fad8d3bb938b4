"""Where a file or folder can be written is known before, and nothing is made."""

import os
from pathlib import Path

import pytest

from mpmworlds.files.targets import check_file, check_folder


def test_what_is_there_and_what_can_be_made_is_accepted(tmp_path):
    (tmp_path / "file").write_text("old")
    check_file(tmp_path / "file")
    check_file(tmp_path / "new" / "newer" / "file")
    check_folder(tmp_path)
    check_folder(tmp_path / "new" / "newer")
    check_file(None)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_relative_paths_are_below_the_working_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    check_file(Path("file"))
    check_folder(Path("new/newer"))


@pytest.mark.parametrize("link", [False, True], ids=["file", "broken link"])
def test_a_file_is_no_folder(link, tmp_path):
    path = tmp_path / "file"
    path.symlink_to("nowhere") if link else path.write_text("mine")
    with pytest.raises(NotADirectoryError, match=f"^{path}: is a file, must be a fol"):
        check_folder(path)
    with pytest.raises(NotADirectoryError, match=rf"^{path}/a/b: {path} is a file, mu"):
        check_file(path / "a" / "b")


def test_a_folder_is_no_file(tmp_path):
    with pytest.raises(IsADirectoryError, match=f"^{tmp_path}: is a folder, must be"):
        check_file(tmp_path)


def test_a_folder_of_somebody_else_is_not_written_to(as_a_user):
    os.chmod(as_a_user, 0o555)
    with pytest.raises(PermissionError, match=r"is not to be written to by you; name"):
        check_file(Path(as_a_user) / "new" / "file")
    os.chmod(as_a_user, 0o755)
