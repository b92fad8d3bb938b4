"""Publishing on a Hub: what is sent, what survives, what is refused.

The command runs in a process of its own, as its settings are read at import.
"""

import os
import re
import shutil
import subprocess
import sys
from types import SimpleNamespace

import pytest

from mpmworlds.builder.release.build import build_release
from mpmworlds.builder.release.shards import Corpus
from mpmworlds.files.checksums import CHECKSUMS, read_checksums, write_checksums
from tests.hub import EXPIRED, READER, WRITER, Hub

NAME = "acme/mpmworlds"
SHARD = "data/tiny/train-00000-of-00003.arrow"


@pytest.fixture
def hub(tmp_path):
    with Hub(tmp_path / "hub") as hub:
        yield hub


@pytest.fixture
def publish(hub, tmp_path):
    """Function (folder, options) -> status, output and messages of the command."""

    def run(folder, *options, token=WRITER, name=NAME, **settings):
        inherited = {k: v for k, v in os.environ.items() if not k.startswith("HF_")}
        arguments = ["publish", str(folder), "--repo-id", name, *options]
        done = subprocess.run(
            [sys.executable, "-m", "mpmworlds", *arguments],
            env=inherited | hub.environment(tmp_path / "home", token) | settings,
            capture_output=True,
            text=True,
            timeout=120,
        )
        lines = [line for line in done.stderr.splitlines() if "mpmworlds" in line]
        assert "Traceback" not in done.stderr
        return SimpleNamespace(
            status=done.returncode, out=done.stdout, err="\n".join(lines)
        )

    return run


@pytest.fixture
def changed(release, tmp_path):
    """A later release: one shard is another, one list is gone."""
    folder = shutil.copytree(release, tmp_path / "changed")
    (folder / "splits/test.txt").unlink()
    with (folder / SHARD).open("ab") as stream:
        stream.write(b"\0" * 8)
    write_checksums(folder)
    return folder


def contents(repository, revision="main"):
    """Path -> content, of a repository, less what the Hub adds."""
    files = repository.commits[repository.resolve(revision)]
    return {
        path: repository.read(path, revision)
        for path in files
        if path != ".gitattributes"
    }


def contents_of(folder):
    paths = [*read_checksums(folder), CHECKSUMS]
    return {path: (folder / path).read_bytes() for path in paths}


def changes(hub):
    """Requests that change a repository."""
    asked = ("repos/create", "/commit/", "/tag/")
    return [path for _, path in hub.requests if any(part in path for part in asked)]


# ---- what is sent


def test_all_files_arrive_and_the_commit_has_the_version_as_tag(publish, hub, release):
    done = publish(release)
    assert done.status == 0, done.err
    repository = hub.repositories[NAME]
    assert contents(repository) == contents_of(release)
    assert repository.tags == {"1.2.3": repository.head}
    assert not repository.private
    assert f"tag 1.2.3 is commit {repository.head}" in done.out


def test_a_second_run_changes_nothing(publish, hub, release):
    publish(release)
    head, sent = hub.repositories[NAME].head, hub.received.copy()
    hub.requests.clear()
    done = publish(release)
    assert (done.status, changes(hub)) == (0, [])
    assert "to send 0 files of 0 bytes" in done.out
    assert (hub.repositories[NAME].head, hub.received) == (head, sent)


def test_a_dry_run_says_what_would_be_sent_and_changes_nothing(
    publish, hub, release, changed
):
    done = publish(release, "--dry-run", token=None)
    sums = read_checksums(release)
    size = sum((release / name).stat().st_size for name in [*sums, CHECKSUMS])
    total = f"{len(sums) + 1} files of {size:,} bytes"
    assert f"(a new repository), tag 1.2.3: {total}; to send {total}\n" in done.out
    assert hub.repositories == {}

    publish(release)
    hub.requests.clear()
    done = publish(changed, "--dry-run", "--revision", "2.0.0")
    told = re.findall(r"^  (send|remove) +[\d,]* +(\S+)$", done.out, re.MULTILINE)
    assert told == [
        ("send", CHECKSUMS),
        ("send", SHARD),
        ("remove", "splits/test.txt"),
    ]
    assert changes(hub) == []


def test_a_later_release_replaces_the_former_which_keeps_its_tag(
    publish, hub, release, changed
):
    publish(release)
    sent = sum(hub.received.values())
    done = publish(changed, "--revision", "2.0.0")
    assert done.status == 0, done.err
    repository = hub.repositories[NAME]
    assert contents(repository, "2.0.0") == contents_of(changed)
    assert contents(repository, "1.2.3") == contents_of(release)
    assert sum(hub.received.values()) - sent == (changed / SHARD).stat().st_size


def test_nothing_hidden_is_sent(publish, hub, release, tmp_path):
    folder = shutil.copytree(release, tmp_path / "release")
    (folder / ".env").write_text("SECRET=1")
    (folder / "data/.notes").mkdir()
    (folder / "data/.notes/x.json").write_text("{}")
    assert publish(folder).status == 0
    assert contents(hub.repositories[NAME]) == contents_of(release)


def test_a_private_repository_is_made_and_a_public_one_is_not_taken_for_one(
    publish, hub, release
):
    assert publish(release, "--private").status == 0
    assert hub.repositories[NAME].private
    hub.repositories[NAME].private = False
    assert "is public; make it private in its settings" in (
        publish(release, "--private").err
    )


@pytest.mark.parametrize("made", ["empty", "with a card"])
def test_an_empty_repository_is_taken(made, publish, hub, release):
    repository = hub.create(NAME)
    if made == "with a card":
        repository.write("README.md", b"---\nlicense: cc-by-4.0\n---\n")
    assert publish(release).status == 0
    assert contents(repository) == contents_of(release)


LOAD = """
from datasets import load_dataset
ids = lambda rows: [row["id"] for row in rows]
for tag in ("1.2.3", "2.0.0", None):
    options = {"split": "train", "revision": tag}
    print(ids(load_dataset("acme/mpmworlds", "tiny", **options)))
    print(ids(load_dataset("acme/mpmworlds", "tiny", streaming=True, **options)))
"""


def test_what_is_published_is_loaded_by_tag_and_streamed(
    publish, hub, release, corpus, tmp_path
):
    later = tmp_path / "later"
    few = Corpus(corpus.manifest, {"tiny": ["p0000", "p0002"]}, name="tiny")
    build_release([few], corpus.store, later, version="2.0.0")
    assert publish(release).status == 0
    assert publish(later).status == 0
    done = subprocess.run(
        [sys.executable, "-c", LOAD],
        env=os.environ | hub.environment(tmp_path / "home", token=None),
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    first = "['p0000', 'p0000-c0', 'p0000-c0-n00', 'p0001', 'p0001-n00']"
    second = "['p0000']"
    assert done.stdout.splitlines() == [first] * 2 + [second] * 4


# ---- what it survives


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "pattern", "fault", "told"),
    [
        ("PUT", "/_lfs/", {"after": 2_000}, ""),  # the client itself tries again
        ("PUT", "/_lfs/", {"status": 503}, ""),
        ("POST", "/commit/", {"status": 503, "times": 2}, "503: injected; again in 1"),
        ("POST", "/commit/", {"after": 100}, "again in 1 s (attempt 1 of 6"),
        (
            "POST",
            "/commit/",
            {"status": 429, "headers": {"Retry-After": "3"}},
            "429: injected, asks to wait 3 s; again in 3 s",
        ),
        ("GET", "/api/datasets/", {"status": 500}, "500: injected; again in 1 s"),
        ("POST", "/tag/", {"status": 502}, "502: injected; again in 1 s"),
    ],
)
def test_a_fault_that_passes_is_survived(
    method, pattern, fault, told, publish, hub, release
):
    if pattern == "/api/datasets/":
        hub.create(NAME)
    fault = {"status": 503, **fault}
    hub.fail(method, pattern, fault.pop("status"), **fault)
    done = publish(release)
    assert done.status == 0, done.err
    assert told in done.err
    assert not hub.faults
    repository = hub.repositories[NAME]
    assert contents(repository) == contents_of(release)
    assert repository.tags == {"1.2.3": repository.head}


def test_a_run_that_was_cut_goes_on_where_it_was(publish, hub, release):
    hub.fail("POST", "/commit/", status=400)  # after all blobs have arrived
    done = publish(release)
    assert done.status == 2
    assert "the Hub refuses it (400: injected)" in done.err
    arrived = hub.received.copy()
    assert sum(arrived.values())
    assert hub.repositories[NAME].tags == {}
    assert publish(release).status == 0
    assert hub.received == arrived
    assert contents(hub.repositories[NAME]) == contents_of(release)


# ---- what is refused: one line, and nothing is tagged


def refused(done, hub, message):
    assert done.status == 2
    assert len(done.err.splitlines()) == 1, done.err
    assert re.search(message, done.err), done.err
    assert not any(repository.tags for repository in hub.repositories.values())


def test_a_damaged_release_is_not_sent(publish, hub, release, tmp_path):
    folder = shutil.copytree(release, tmp_path / "release")
    data = bytearray((folder / SHARD).read_bytes())
    data[len(data) // 2] ^= 1
    (folder / SHARD).write_bytes(data)
    refused(publish(folder), hub, rf"{SHARD}: its sha256 is not .* nothing was sent")
    (folder / SHARD).unlink()
    refused(publish(folder), hub, f"{SHARD}: is missing")
    shutil.copy(release / SHARD, folder / SHARD)
    (folder / "notes.md").write_text("mine")
    refused(publish(folder), hub, f"notes.md: is not in {CHECKSUMS}")
    (folder / "notes.md").unlink()
    (folder / ".build").mkdir()
    refused(publish(folder), hub, "is not finished; run `mpmworlds build` again")
    assert hub.requests == []


def test_what_is_no_release_is_not_sent(publish, hub, tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    refused(publish(tmp_path / "nowhere"), hub, "nowhere: there is no such folder")
    refused(publish(tmp_path), hub, f"{CHECKSUMS}: is not there")
    write_checksums(tmp_path)
    refused(publish(tmp_path), hub, "is no release")
    assert hub.requests == []


def test_a_repository_with_other_content_is_left_alone(publish, hub, release):
    repository = hub.create(NAME)
    repository.write("model.bin", b"weights")
    head = repository.head
    done = publish(release)
    refused(done, hub, r"holds 'model.bin', which is no part of a release \(1 such")
    repository.write(CHECKSUMS, f"{'0' * 64}  model.bin\n".encode())  # not a mark
    refused(publish(release), hub, "which is no part of a release")
    assert repository.parents[repository.head] == head
    assert not hub.received


def test_a_file_that_somebody_added_to_our_repository_is_not_removed(
    publish, hub, release, changed
):
    publish(release)
    hub.repositories[NAME].write("mine.csv", b"1,2\n")
    done = publish(changed, "--revision", "2.0.0")
    assert done.status == 2
    assert "holds 'mine.csv'" in done.err
    assert "mine.csv" in hub.repositories[NAME].files


def test_a_tag_of_another_release_is_not_moved(publish, hub, release, changed):
    publish(release)
    repository = hub.repositories[NAME]
    tagged, sent = dict(repository.tags), hub.received.copy()
    done = publish(changed)
    assert done.status == 2
    assert f"tag 1.2.3 is on commit {repository.head[:12]}, which holds" in done.err
    assert (repository.tags, hub.received) == (tagged, sent)


def test_a_file_that_arrives_damaged_is_not_tagged(publish, hub, release, monkeypatch):
    keep = hub.keep

    def other(path, data):
        return keep(path, data + b"\n" if path == "README.md" else data)

    monkeypatch.setattr(hub, "keep", other)
    message = r"README.md is another at commit \w+, against .* nothing is tagged"
    refused(publish(release), hub, message)


@pytest.mark.parametrize(
    ("token", "message"),
    [
        (None, "HF_TOKEN is not set; make a token with write access at http"),
        (EXPIRED, r'HF_TOKEN: .* not accept it \(401: User Access Token "test" is exp'),
        ("hf_wrong", r"HF_TOKEN: the Hub does not accept it \(401: Invalid cred"),
        (READER, "HF_TOKEN gives no right to do that .403: You don't have the rights"),
    ],
)
def test_a_token_that_will_not_do_is_named(token, message, publish, hub, release):
    refused(publish(release, token=token), hub, message)
    assert hub.repositories == {}


def test_a_repository_of_somebody_else_is_refused(publish, hub, release):
    done = publish(release, name="other/mpmworlds")
    refused(done, hub, "other/mpmworlds: HF_TOKEN gives no right to do that")


@pytest.mark.parametrize("name", ["mpmworlds", "a/b/c", "acme/a--b..c"])
def test_a_name_that_no_repository_can_have_is_refused(name, publish, hub, release):
    refused(publish(release, name=name), hub, "must be OWNER/NAME|is no name of a rep")


def test_a_tag_that_git_would_not_take_is_refused(publish, hub, release):
    refused(publish(release, "--revision", "a b"), hub, "--revision 'a b': must be")


def test_a_wait_that_is_too_long_is_left_to_the_user(publish, hub, release):
    hub.fail("POST", "/commit/", 429, headers={"Retry-After": "3600"})
    message = r"the Hub is busy \(429: injected, asks to wait 3600 s\).* run it again"
    refused(publish(release), hub, message)


def test_without_a_network_there_is_one_clear_line(publish, hub, release):
    hub.close()
    message = f"{hub.url}: cannot be reached .* check the network and run it again"
    refused(publish(release), hub, message)
    offline = publish(release, HF_HUB_OFFLINE="1")
    refused(offline, hub, "HF_HUB_OFFLINE is set: unset it")
