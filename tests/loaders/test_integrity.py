"""Every file of a release is checked once, and again when it has changed."""

import os
import shutil

import pytest

from mpmworlds.files.checksums import ChecksumError, read_checksums
from mpmworlds.loaders import integrity
from mpmworlds.loaders.integrity import check_release


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def hashed(monkeypatch):
    """Names of the files that were read in full."""
    names = []

    def spy(path):
        names.append(path.name)
        return original(path)

    original = integrity.sha256_of_file
    monkeypatch.setattr(integrity, "sha256_of_file", spy)
    return names


@pytest.fixture
def copy(release, tmp_path):
    return shutil.copytree(release, tmp_path / "copy")


def test_a_file_is_hashed_once_while_it_does_not_change(copy, hashed):
    check_release(copy)
    assert len(hashed) == len(read_checksums(copy)) == 20
    check_release(copy)
    assert len(hashed) == 20
    os.utime(copy / "README.md")
    check_release(copy)
    assert hashed[20:] == ["README.md"]


def test_only_the_files_asked_for_are_hashed(copy, hashed):
    check_release(copy, ["splits/test.txt"])
    assert hashed == ["test.txt"]


@pytest.mark.parametrize("checked_before", [True, False])
def test_a_flipped_bit_is_found(copy, checked_before):
    if checked_before:
        check_release(copy)
    path = copy / "data/tiny/train-00001-of-00003.arrow"
    data = bytearray(path.read_bytes())
    data[1234] ^= 1
    path.write_bytes(data)
    with pytest.raises(ChecksumError, match=r"train-00001-of-00003.arrow: its sha256"):
        check_release(copy)


def test_swapped_files_are_found(copy):
    first, second = (copy / f"data/tiny/train-0000{n}-of-00003.arrow" for n in (0, 1))
    first.rename(copy / "aside")
    second.rename(first)
    (copy / "aside").rename(second)
    with pytest.raises(ChecksumError, match="and 1 more files"):
        check_release(copy)


def test_a_missing_file_is_an_error(copy):
    (copy / "data/tiny/train-00001-of-00003.arrow").unlink()
    with pytest.raises(ChecksumError, match="is missing, SHA256SUMS names it"):
        check_release(copy)


def test_a_configuration_may_be_left_out_as_a_whole(copy):
    shutil.rmtree(copy / "data/mini")
    check_release(copy)


def test_a_damaged_list_of_checksums_is_named(copy):
    (copy / "SHA256SUMS").write_text("0123  README.md\n")
    with pytest.raises(ChecksumError, match=r"unreadable line '0123  README.md'"):
        check_release(copy)


def test_a_record_that_cannot_be_read_or_written_costs_time_only(
    copy, hashed, tmp_path, monkeypatch
):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    check_release(copy)
    check_release(copy)
    assert len(hashed) == 40
