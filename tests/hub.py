"""A Hub on the loopback interface: what `huggingface_hub` and `datasets` talk to.

    with Hub(tmp_path / "hub") as hub:
        repository = hub.serve(release, "acme/mpmworlds", tag="1.2.3")
        subprocess.run([...], env=os.environ | hub.environment(tmp_path / "home"))

Files are uploaded (LFS batch, commits, tags), listed, and downloaded whole or by ranges
as on the real one, large ones by a redirect. Faults are asked for with `fail` and
`cut`, and damage to what is kept with `Repository.flip_byte` and `remove`.
"""

import hashlib
import re
import threading
from collections import Counter
from dataclasses import dataclass, field
from http.server import ThreadingHTTPServer
from pathlib import Path

from tests.hub_server import Handler

WRITER, READER, EXPIRED = "hf_writer", "hf_reader", "hf_expired"
USER, ORGANISATION = "tester", "acme"  # of both tokens
LFS = (".arrow", ".parquet", ".mp4", ".png", ".bin")
REGULAR_AT_MOST = 10_000_000
ATTRIBUTES = "".join(f"*{ending} filter=lfs -text\n" for ending in LFS).encode()


@dataclass
class Entry:
    """A file of a repository. Commits share it, so damage is in all of them."""

    source: Path
    size: int
    oid: str  # SHA-256 of an LFS object, else the blob id of Git
    lfs: bool

    @property
    def git_oid(self):
        return hashlib.sha1(self.oid.encode()).hexdigest() if self.lfs else self.oid


class Repository:
    """Commits, branches and tags of a dataset repository."""

    def __init__(self, hub, name, private=False):
        self.hub, self.name, self.private = hub, name, private
        self.commits, self.titles, self.parents = {}, {}, {}
        self.branches, self.tags = {}, {}
        self.commit({".gitattributes": hub.keep(".gitattributes", ATTRIBUTES)})

    @property
    def head(self):
        """Commit of `main`."""
        return self.branches["main"]

    @property
    def files(self):
        """Path -> entry, of `main`."""
        return self.commits[self.head]

    def commit(self, files, title="initial commit", branch="main"):
        """Make `files` the whole content of a branch; return the commit."""
        parent = self.branches.get(branch)
        told = [
            len(self.commits),
            parent,
            title,
            sorted((p, e.oid) for p, e in files.items()),
        ]
        sha = hashlib.sha1(repr(told).encode()).hexdigest()
        self.commits[sha], self.titles[sha] = dict(files), title
        self.parents[sha], self.branches[branch] = parent, sha
        return sha

    def resolve(self, revision):
        """Commit that a branch, tag or hash names, or None."""
        named = self.branches.get(revision) or self.tags.get(revision)
        return named or (revision if revision in self.commits else None)

    def write(self, path, data):
        """Commit other content of one file to `main`."""
        entry = self.hub.keep(path, data)
        return self.commit(self.files | {path: entry}, f"write {path}")

    def read(self, path, revision="main"):
        """Content of a file."""
        return self.commits[self.resolve(revision)][path].source.read_bytes()

    def flip_byte(self, path, offset=None):
        """Damage a kept file, in its middle unless told; its hash is told as before."""
        entry = self.files[path]
        data = bytearray(entry.source.read_bytes())
        data[len(data) // 2 if offset is None else offset] ^= 1
        entry.source = self.hub.folder / f"damaged-{entry.oid}"
        entry.source.write_bytes(data)

    def remove(self, path):
        """Lose a file, in every commit."""
        for files in self.commits.values():
            files.pop(path, None)


@dataclass
class Fault:
    """What happens to requests in place of an answer."""

    method: str
    pattern: str
    status: int = 503
    headers: dict = field(default_factory=dict)
    content: dict = field(default_factory=lambda: {"error": "injected"})
    times: int = 1
    after: int | None = None  # bytes of content until the connection is cut


class Hub:
    """A server, its repositories, and what they were asked for.

    `requests` lists (method, path), `sent` counts bytes of content by path in the
    repository, `received` bytes of each LFS object by its SHA-256.
    """

    page = 1000  # entries of a listing in one answer

    def __init__(self, folder):
        self.folder = Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.repositories, self.faults = {}, []
        self.requests, self.sent, self.received = [], Counter(), Counter()
        self.tokens = {WRITER: "write", READER: "read"}
        self.lock = threading.RLock()
        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.daemon_threads, self.server.hub = True, self
        port = self.server.server_address[1]
        self.url = f"http://127.0.0.1:{port}"
        self.cdn = f"http://localhost:{port}/_cdn"  # another host, as of the real one
        self.thread = threading.Thread(target=self.server.serve_forever, daemon=True)
        self.thread.start()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.close()

    def close(self):
        """End the server. Its address refuses connections from then on."""
        self.server.shutdown()
        self.server.server_close()
        self.thread.join()

    def environment(self, home, token=WRITER):
        """Variables with which a process talks to this Hub, from a home of its own."""
        told = {
            "HF_ENDPOINT": self.url,
            "HF_HOME": str(home),
            "HF_HUB_DISABLE_XET": "1",
            "HF_HUB_DISABLE_TELEMETRY": "1",
            "HF_HUB_OFFLINE": "0",
            "NO_PROXY": "127.0.0.1,localhost",
            "no_proxy": "127.0.0.1,localhost",
        }
        return told | ({"HF_TOKEN": token} if token else {})

    def create(self, name, private=False):
        """Make an empty repository."""
        self.repositories[name] = Repository(self, name, private)
        return self.repositories[name]

    def serve(self, folder, name, tag=None):
        """Make a repository of a folder's files, hidden ones left out."""
        repository = self.create(name)
        paths = sorted(p for p in Path(folder).rglob("*") if p.is_file())
        files = dict(repository.files)
        for path in paths:
            relative = path.relative_to(folder)
            if not any(part.startswith(".") for part in relative.parts):
                files[relative.as_posix()] = self.entry_of(relative.as_posix(), path)
        commit = repository.commit(files, f"serve {name}")
        if tag:
            repository.tags[tag] = commit
        return repository

    def keep(self, path, data):
        """Store content; return its entry."""
        source = self.blob(hashlib.sha256(data).hexdigest())
        source.write_bytes(data)
        return self.entry_of(path, source)

    def blob(self, sha256):
        """File of an LFS object."""
        return self.folder / sha256

    def fail(self, method, pattern, status=503, **told):
        """Answer the next requests of paths that hold `pattern` with a status."""
        self.faults.append(Fault(method, pattern, status, **told))

    def cut(self, method, pattern, after, times=1):
        """Cut the connection of the next requests after so many bytes of content."""
        self.faults.append(Fault(method, pattern, times=times, after=after))

    def fault_of(self, method, path):
        """The fault that a request meets, which is then used up."""
        with self.lock:
            for fault in self.faults:
                if fault.method == method and re.search(fault.pattern, path):
                    fault.times -= 1
                    if not fault.times:
                        self.faults.remove(fault)
                    return fault
        return None

    @staticmethod
    def is_lfs(path, size):
        """Whether the Hub keeps a file by LFS."""
        return path.endswith(LFS) or size > REGULAR_AT_MOST

    @classmethod
    def entry_of(cls, path, source):
        """Entry of a file that has its content from elsewhere."""
        size = source.stat().st_size
        if cls.is_lfs(path, size):
            with source.open("rb") as stream:
                oid = hashlib.file_digest(stream, "sha256").hexdigest()
            return Entry(source, size, oid, lfs=True)
        data = source.read_bytes()
        oid = hashlib.sha1(b"blob %d\0" % size + data).hexdigest()
        return Entry(source, size, oid, lfs=False)
