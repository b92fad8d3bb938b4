"""A dataset repository on the Hub: what is tried again, and what refusals mean."""

import os
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeVar

import httpx2
from huggingface_hub import HfApi
from huggingface_hub.errors import (
    HfHubHTTPError,
    HFValidationError,
    OfflineModeIsEnabled,
    RepositoryNotFoundError,
)
from huggingface_hub.hf_api import RepoFile

TOKEN: Final = "HF_TOKEN"  # noqa: S105  its name, not its value
ATTEMPTS: Final = 6
LONGEST_WAIT: Final = 300.0  # [s] that we wait when the Hub asks for it

_KIND: Final = "dataset"
_AGAIN: Final = (408, 429, 500, 502, 503, 504)
_T = TypeVar("_T")


class PublishError(ValueError):
    """A release that cannot be published, and what to do about it."""


@dataclass(frozen=True)
class RemoteFile:
    """What the Hub tells of a file: its size [bytes] and its SHA-256 or Git blob id."""

    size: int
    sha256: str | None  # of files that are kept by LFS
    blob_id: str


@dataclass(frozen=True)
class RemoteState:
    """What a repository holds: the head of `main`, its files, tag -> commit."""

    commit: str
    private: bool
    files: dict[str, RemoteFile]
    tags: dict[str, str]


class HubRepository:
    """A dataset repository, asked and changed with the token in ``$HF_TOKEN``.

    Parameters
    ----------
    repo_id
        Its name, ``OWNER/NAME``.
    report
        Is told, in a line each, what is tried again.
    """

    def __init__(self, repo_id: str, report: Callable[[str], None]) -> None:
        if repo_id.count("/") != 1:
            raise PublishError(f"{repo_id}: must be OWNER/NAME, such as me/mpmworlds")
        self.repo_id = repo_id
        self.has_token = bool(os.environ.get(TOKEN))
        self._api = HfApi(token=os.environ.get(TOKEN) or False)
        self._report = report

    def state(self) -> RemoteState | None:
        """Return what the repository holds, or None if there is none.

        Raises
        ------
        PublishError
            If the Hub refuses to tell, or cannot be reached.
        """
        try:
            info = self._call(
                lambda: self._api.repo_info(self.repo_id, repo_type=_KIND)
            )
        except _AbsentError:
            return None
        refs = self._call(
            lambda: self._api.list_repo_refs(self.repo_id, repo_type=_KIND)
        )
        return RemoteState(
            commit=str(info.sha),
            private=bool(info.private),
            files=self.files(str(info.sha)),
            tags={tag.name: tag.target_commit for tag in refs.tags},
        )

    def files(self, commit: str) -> dict[str, RemoteFile]:
        """Return the files of a commit by path."""

        def listed() -> dict[str, RemoteFile]:
            entries = self._api.list_repo_tree(
                self.repo_id, repo_type=_KIND, revision=commit, recursive=True
            )
            return {
                entry.path: RemoteFile(
                    entry.size, entry.lfs.sha256 if entry.lfs else None, entry.blob_id
                )
                for entry in entries
                if isinstance(entry, RepoFile)
            }

        return self._call(listed)

    def read(self, path: str, commit: str) -> bytes:
        """Return the content of a small file."""
        with tempfile.TemporaryDirectory() as folder:

            def fetched() -> str:
                return self._api.hf_hub_download(
                    self.repo_id,
                    path,
                    repo_type=_KIND,
                    revision=commit,
                    cache_dir=folder,
                )

            return Path(self._call(fetched)).read_bytes()

    def create(self, *, private: bool) -> None:
        """Make the repository unless there is one."""
        self._call(
            lambda: self._api.create_repo(
                self.repo_id, repo_type=_KIND, private=private, exist_ok=True
            )
        )

    def upload(
        self, folder: Path, paths: list[str], stale: list[str], message: str
    ) -> str:
        """Upload files of a folder, delete stale ones; return the commit.

        What has arrived is not sent again, neither when a broken connection makes us
        repeat the call nor when the command is run again.
        """
        return str(
            self._call(
                lambda: self._api.upload_folder(
                    repo_id=self.repo_id,
                    repo_type=_KIND,
                    folder_path=folder,
                    allow_patterns=paths,
                    delete_patterns=stale or None,
                    commit_message=message,
                )
            ).oid
        )

    def tag(self, name: str, commit: str) -> None:
        """Name a commit."""
        self._call(
            lambda: self._api.create_tag(
                self.repo_id, tag=name, revision=commit, repo_type=_KIND
            )
        )

    def _call(self, action: Callable[[], _T]) -> _T:
        """Carry out a request; repeat it while there is hope."""
        with _refusals_named(self.repo_id, self._api.endpoint, self.has_token):
            for attempt in range(1, ATTEMPTS):
                try:
                    return action()
                except (HfHubHTTPError, httpx2.TransportError) as error:
                    wait = seconds_to_wait(error, attempt)
                    if wait is None:
                        raise
                    self._report(
                        f"{self.repo_id}: {_told(error)}; again in {wait:g} s "
                        f"(attempt {attempt} of {ATTEMPTS} failed)"
                    )
                time.sleep(wait)
            return action()


def seconds_to_wait(error: Exception, attempt: int) -> float | None:
    """Return how long [s] to wait before a request is repeated, None for never.

    A refusal is final. An overloaded Hub (429, 5xx) says by ``Retry-After`` how long to
    wait; a wait above `LONGEST_WAIT` is left to the user. Otherwise, and after a broken
    connection, the wait doubles with each attempt.

    Parameters
    ----------
    error
        How the request failed.
    attempt
        Which one it was, from 1.
    """
    growing = float(2 ** (attempt - 1))
    if not isinstance(error, HfHubHTTPError):
        # Nobody listens at all: a longer wait does not help.
        return None if isinstance(error, httpx2.ConnectError) else growing
    if error.response.status_code not in _AGAIN:
        return None
    told = error.response.headers.get("Retry-After", "")
    wait = float(told) if told.isdecimal() else growing
    return wait if wait <= LONGEST_WAIT else None


class _AbsentError(PublishError):
    """There is no such repository, or nobody without a token may see it."""


@contextmanager
def _refusals_named(repo_id: str, endpoint: str, has_token: bool) -> Iterator[None]:
    """Turn what the client raises into one line that says what to do."""
    try:
        yield
    except OfflineModeIsEnabled as error:
        raise PublishError(
            "HF_HUB_OFFLINE is set: unset it, for publishing needs the Hub"
        ) from error
    except HFValidationError as error:
        raise PublishError(
            f"{repo_id}: is no name of a repository ({error})"
        ) from error
    except httpx2.TransportError as error:
        raise PublishError(
            f"{endpoint}: cannot be reached ({_told(error)}); check the network and "
            "run it again: what has arrived is not sent again"
        ) from error
    except HfHubHTTPError as error:
        raise _named(error, repo_id, endpoint, has_token) from error


def _named(
    error: HfHubHTTPError, repo_id: str, endpoint: str, has_token: bool
) -> PublishError:
    status, told = error.response.status_code, _told(error)
    if status == 401 and has_token:
        return PublishError(
            f"{TOKEN}: the Hub does not accept it ({told}); make a new one with write "
            f"access at {endpoint}/settings/tokens"
        )
    if status == 401:  # the Hub does not tell strangers what there is
        return _AbsentError(f"{repo_id}: {no_token(endpoint)}")
    if isinstance(error, RepositoryNotFoundError):
        return _AbsentError(f"{repo_id}: there is no such repository ({told})")
    if status == 403:
        return PublishError(
            f"{repo_id}: {TOKEN} gives no right to do that ({told}); use a token with "
            "write access of an account that may write there"
        )
    if status in _AGAIN:
        return PublishError(
            f"{repo_id}: the Hub is busy ({told}) and was asked {ATTEMPTS} times; run "
            "it again later: what has arrived is not sent again"
        )
    return PublishError(f"{repo_id}: the Hub refuses it ({told})")


def no_token(endpoint: str) -> str:
    """Return what to do where there is no token."""
    return (
        f"{TOKEN} is not set; make a token with write access at "
        f"{endpoint}/settings/tokens and set the variable to it"
    )


def _told(error: Exception) -> str:
    if isinstance(error, HfHubHTTPError):
        message = (error.server_message or "").strip().splitlines()
        status = error.response.status_code
        wait = error.response.headers.get("Retry-After")
        asks = f", asks to wait {wait} s" if wait else ""
        return f"{status}{': ' + message[0] if message else ''}{asks}"
    return f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
