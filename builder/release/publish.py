"""Publish a release on the Hub: check it, upload it, check it there, tag it.

A repository is either new, empty, or one that holds a release of ours. Files are
compared by hash, so what is there already is not sent, and a run that was cut goes on.
Only the tag makes an upload a version: until all is there and checked, there is none.
"""

import hashlib
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from huggingface_hub import constants as hub_constants
from tqdm import tqdm  # type: ignore[import-untyped]

from mpmworlds.builder.release.hub import (
    HubRepository,
    PublishError,
    RemoteFile,
    RemoteState,
    no_token,
)
from mpmworlds.builder.release.layout import CARD, RECORD, read_record
from mpmworlds.builder.release.writing import NOTES
from mpmworlds.files.checksums import (
    CHECKSUMS,
    files_below,
    read_checksums,
    sha256_of_file,
)
from mpmworlds.files.targets import refuse_file

_OF_AN_EMPTY_REPOSITORY: Final = (".gitattributes", CARD)
_TAG: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+-]*", re.ASCII)


@dataclass(frozen=True)
class LocalFile:
    """A file to publish: its size [bytes] and SHA-256."""

    size: int
    sha256: str


@dataclass(frozen=True)
class Upload:
    """What publishing a release will do.

    Attributes
    ----------
    folder, repository, tag, private
        The release, where it goes, and what the commit will be called.
    files
        Path -> what is to be there.
    there
        Paths that the repository has already, with the same content.
    stale
        Paths of a former release that will be removed.
    exists
        Whether there is a repository.
    published
        The commit, if the tag already names this very release.
    """

    folder: Path
    repository: HubRepository
    tag: str
    private: bool
    files: Mapping[str, LocalFile]
    there: frozenset[str]
    stale: tuple[str, ...]
    exists: bool
    published: str | None

    @property
    def to_send(self) -> list[str]:
        """Paths to upload."""
        return [path for path in self.files if path not in self.there]

    def described(self) -> str:
        """Return in lines what will be uploaded and removed."""
        size = {path: file.size for path, file in self.files.items()}
        where = "there" if self.exists else "a new repository"
        sent = _amount([size[path] for path in self.to_send])
        head = f"{self.repository.repo_id} ({where}), tag {self.tag}"
        lines = [f"{head}: {_amount(list(size.values()))}; to send {sent}"]
        lines += [f"  send    {size[path]:>15,}  {path}" for path in self.to_send]
        lines += [f"  remove  {'':>15}  {path}" for path in self.stale]
        return "\n".join(lines)


def _amount(sizes: list[int]) -> str:
    return f"{len(sizes)} files of {sum(sizes):,} bytes"


def plan_upload(
    folder: Path,
    repo_id: str,
    *,
    revision: str | None = None,
    private: bool = False,
    report: Callable[[str], None],
) -> Upload:
    """Check a release and what the Hub holds; change nothing.

    Parameters
    ----------
    folder
        The release.
    repo_id
        Where it goes, ``OWNER/NAME``.
    revision
        Tag; the version of the data if None.
    private
        Whether a new repository is private.
    report
        Is told, in a line each, what is tried again.

    Raises
    ------
    PublishError
        If the folder is no release or a damaged one, the repository holds something
        else, the tag names another release, or the Hub cannot be asked.
    """
    files = _checked(folder)
    tag = revision or read_record(folder).version
    if not _TAG.fullmatch(tag):
        raise PublishError(
            f"--revision {tag!r}: must be letters, digits and . _ + -, such as 1.0.0"
        )
    repository = HubRepository(repo_id, report)
    state = repository.state()
    if state is None:
        return Upload(
            folder, repository, tag, private, files, frozenset(), (), False, None
        )
    if private and not state.private:
        raise PublishError(
            f"{repo_id}: is public; make it private in its settings, or leave --private"
        )
    there = _same(folder, files, state.files)
    former = _former_files(repository, state)
    _check_ours(repo_id, state, former, there)
    published = None
    if tag in state.tags:
        published = state.tags[tag]
        if _same(folder, files, repository.files(published)) != set(files):
            raise PublishError(
                f"{repo_id}: tag {tag} is on commit {published[:12]}, which holds "
                "another release; raise `version` in params.yaml and build, or name "
                "another --revision"
            )
    stale = tuple(sorted(former & state.files.keys() - files.keys()))
    return Upload(
        folder, repository, tag, private, files, there, stale, True, published
    )


def publish(upload: Upload) -> str:
    """Carry out an upload; return the commit, which then has the tag.

    Raises
    ------
    PublishError
        If the Hub refuses or cannot be reached, or what is there afterwards is not
        the release: then there is no tag.
    """
    if upload.published is not None:
        return upload.published
    repository = upload.repository
    if not repository.has_token:
        raise PublishError(no_token(hub_constants.ENDPOINT))
    if not upload.exists:
        repository.create(private=upload.private)
    commit = repository.upload(
        upload.folder, list(upload.files), list(upload.stale), f"Release {upload.tag}"
    )
    arrived = repository.files(commit)
    same = _same(upload.folder, upload.files, arrived)
    if wrong := sorted(upload.files.keys() - same):
        what = "is another" if wrong[0] in arrived else "is missing"
        raise PublishError(
            f"{repository.repo_id}: {wrong[0]} {what} at commit {commit[:12]}, against "
            f"{CHECKSUMS} ({len(wrong)} such files); nothing is tagged, run it again"
        )
    repository.tag(upload.tag, commit)
    return commit


def _checked(folder: Path) -> dict[str, LocalFile]:
    """All files of a release that is whole; nothing hidden is among them."""
    refuse_file(folder)
    if not folder.is_dir():
        raise PublishError(f"{folder}: there is no such folder; build a release there")
    sums = read_checksums(folder)
    if not _is_release(sums):
        raise PublishError(
            f"{folder}: is no release ({CHECKSUMS} names no {RECORD}); build it again"
        )
    if (folder / NOTES).exists():
        raise PublishError(f"{folder}: is not finished; run `mpmworlds build` again")
    strangers = [name for name in files_below(folder) if name not in sums]
    problems = [f"{folder / name}: is not in {CHECKSUMS}" for name in strangers]
    for name in tqdm(sums, desc="checksums", unit="file", delay=2, leave=False):
        path = folder / name
        if not path.is_file():
            problems.append(f"{path}: is missing, {CHECKSUMS} names it")
        elif sha256_of_file(path) != sums[name]:
            problems.append(f"{path}: its sha256 is not the one in {CHECKSUMS}")
    if problems:
        more = f" (and {len(problems) - 1} more files)" if problems[1:] else ""
        raise PublishError(
            f"{problems[0]}{more}: the release is damaged; build it again, nothing was "
            "sent"
        )
    hashes = sums | {CHECKSUMS: sha256_of_file(folder / CHECKSUMS)}
    return {
        name: LocalFile((folder / name).stat().st_size, hashes[name])
        for name in sorted(hashes)
    }


def _is_release(names: Collection[str]) -> bool:
    """Whether a list of checksums is that of a release."""
    return {CARD, RECORD} <= set(names)


def _same(
    folder: Path, files: Mapping[str, LocalFile], remote: Mapping[str, RemoteFile]
) -> frozenset[str]:
    """Paths whose content on the Hub is ours, by size and hash."""
    same = set()
    for path in files.keys() & remote.keys():
        ours, theirs = files[path], remote[path]
        if ours.size == theirs.size:
            if theirs.sha256 is not None:
                equal = theirs.sha256 == ours.sha256
            else:
                equal = theirs.blob_id == _blob_id(folder / path)
            if equal:
                same.add(path)
    return frozenset(same)


def _blob_id(path: Path) -> str:
    """What Git calls a file: files below the limits of LFS have no SHA-256 there."""
    data = path.read_bytes()
    header = b"blob %d\0" % len(data)
    return hashlib.sha1(header + data, usedforsecurity=False).hexdigest()


def _former_files(repository: HubRepository, state: RemoteState) -> set[str]:
    """Paths of the release that the repository holds; empty if it holds none."""
    if CHECKSUMS not in state.files:
        return set()
    text = repository.read(CHECKSUMS, state.commit).decode(errors="replace")
    names = {line.partition("  ")[2] for line in text.splitlines()}
    return {CHECKSUMS, *names} if _is_release(names) else set()


def _check_ours(
    repo_id: str, state: RemoteState, former: set[str], there: frozenset[str]
) -> None:
    known = {*former, *there, *_OF_AN_EMPTY_REPOSITORY}
    if strangers := sorted(state.files.keys() - known):
        raise PublishError(
            f"{repo_id}: holds {strangers[0]!r}, which is no part of a release "
            f"({len(strangers)} such files); name a new or an empty repository"
        )
