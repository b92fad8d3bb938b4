"""SHA256SUMS covers a tree, in a form that sha256sum reads."""

import subprocess

import pytest

from mpmworlds.files.checksums import (
    ChecksumError,
    files_below,
    read_checksums,
    sha256_of_file,
    write_checksums,
)


@pytest.fixture
def tree(tmp_path):
    (tmp_path / "data" / "deep").mkdir(parents=True)
    for name in ("b.txt", "a file.txt", "data/deep/c.bin", "data/SHA256SUMS"):
        (tmp_path / name).write_text(f"content of {name}")
    (tmp_path / ".cache").mkdir()
    (tmp_path / ".cache" / "x").write_text("of a tool")
    (tmp_path / ".gitattributes").write_text("of a tool")
    write_checksums(tmp_path)
    return tmp_path


NAMES = ["a file.txt", "b.txt", "data/SHA256SUMS", "data/deep/c.bin"]


def test_all_files_but_hidden_ones_and_the_list_itself_are_listed(tree):
    assert list(read_checksums(tree)) == files_below(tree) == NAMES


def test_checksums_are_those_of_the_files(tree):
    for name, digest in read_checksums(tree).items():
        assert digest == sha256_of_file(tree / name)


def test_the_sha256sum_command_agrees(tree):
    command = ["sha256sum", "--check", "--strict", "--quiet", "SHA256SUMS"]
    subprocess.run(command, cwd=tree, check=True)


def test_writing_twice_changes_no_byte(tree):
    before = (tree / "SHA256SUMS").read_bytes()
    write_checksums(tree)
    assert (tree / "SHA256SUMS").read_bytes() == before


@pytest.mark.parametrize("line", ["", "0123  a", "G" * 64 + "  a", "0" * 64 + " a"])
def test_a_line_of_another_form_is_an_error(tree, line):
    (tree / "SHA256SUMS").write_text(line + "\n")
    with pytest.raises(ChecksumError, match="must be '<sha256>  <path>'"):
        read_checksums(tree)


def test_a_folder_without_a_list_is_an_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        read_checksums(tmp_path)
