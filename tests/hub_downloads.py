"""What the loopback Hub tells and sends; see `tests.hub`."""

import hashlib
import json
import re
from urllib.parse import parse_qs, urlsplit

from tests.hub_requests import CHUNK, RefusedError, Requests


class Downloads(Requests):
    """Accounts, descriptions, listings and content."""

    def whoami(self):
        role = self.token()
        if role is None:
            raise RefusedError(401, "Invalid username or password.")
        access = {"displayName": "test", "role": role}
        self.answer(
            200,
            {
                "type": "user",
                "name": "tester",
                "orgs": [{"name": "acme"}],
                "auth": {"type": "access_token", "accessToken": access},
            },
        )

    def info(self, name, revision=None):
        repository, commit = self.commit_of(name, revision)
        self.answer(
            200,
            {
                "_id": "0" * 24,
                "id": name,
                "author": name.partition("/")[0],
                "sha": commit,
                "private": repository.private,
                "gated": False,
                "disabled": False,
                "tags": [],
                "downloads": 0,
                "likes": 0,
                "lastModified": "2026-01-01T00:00:00.000Z",
                "createdAt": "2026-01-01T00:00:00.000Z",
                "siblings": [
                    {"rfilename": path} for path in sorted(repository.commits[commit])
                ],
            },
        )

    def refs(self, name):
        repository = self.repository(name)
        kinds = {"heads": repository.branches, "tags": repository.tags}
        branches, tags = (
            [
                {"name": ref, "ref": f"refs/{kind}/{ref}", "targetCommit": commit}
                for ref, commit in refs.items()
            ]
            for kind, refs in kinds.items()
        )
        self.answer(200, {"branches": branches, "tags": tags, "converts": []})

    def history(self, name, revision):
        repository, commit = self.commit_of(name, revision)
        found = []
        while commit:
            title, date = repository.titles[commit], "2026-01-01T00:00:00.000Z"
            authors = [{"user": "tester"}]
            found.append(
                {
                    "id": commit,
                    "title": title,
                    "message": "",
                    "authors": authors,
                    "date": date,
                }
            )
            commit = repository.parents[commit]
        self.answer(200, found)

    def tree(self, name, revision, below=None):
        repository, commit = self.commit_of(name, revision)
        files = repository.commits[commit]
        start = f"{below.strip('/')}/" if below and below.strip("/") else ""
        paths = [path for path in sorted(files) if path.startswith(start)]
        if start and not paths:
            raise RefusedError(404, f"{below} does not exist", "EntryNotFound")
        found = {}
        recursive = self.query.get("recursive", "").lower() in ("1", "true")
        for path in paths:
            parts = path.removeprefix(start).split("/")
            for depth in range(1, len(parts) if recursive else min(len(parts), 2)):
                folder = start + "/".join(parts[:depth])
                found[folder] = directory(folder)
            if recursive or len(parts) == 1:
                found[path] = listed(path, files[path])
        first = int(self.query.get("cursor", 0))
        rest = list(found.values())[first:]
        headers = {}
        if len(rest) > self.hub.page:
            told = f"recursive={recursive}&cursor={first + self.hub.page}"
            here = urlsplit(self.path).path
            headers["Link"] = f'<{self.hub.url}{here}?{told}>; rel="next"'
        self.answer(200, rest[: self.hub.page], headers)

    def paths_info(self, name, revision):
        body = self.body().decode()
        _, files = self.commit_of(name, revision)
        files = self.repository(name).commits[files]
        asked = json.loads(body) if body[:1] == "{" else parse_qs(body)
        found = []
        for path in (path.strip("/") for path in asked["paths"]):
            if path in files:
                found.append(listed(path, files[path]))
            elif any(file.startswith(f"{path}/") for file in files):
                found.append(directory(path))
        self.answer(200, found)

    def resolve(self, name, revision, path):
        repository, commit = self.commit_of(name, revision)
        entry = repository.commits[commit].get(path)
        headers = {"X-Repo-Commit": commit, "Accept-Ranges": "bytes"}
        if entry is None:
            code = {"X-Error-Code": "EntryNotFound"}
            return self.answer(404, {"error": "Entry not found"}, {**headers, **code})
        if entry.lfs:
            headers["X-Linked-Size"] = str(entry.size)
            headers["X-Linked-ETag"] = f'"{entry.oid}"'
            headers["Location"] = f"{self.hub.cdn}/{name}/{commit}/{path}"
            return self.answer(302, b"", headers)
        headers["ETag"] = f'"{entry.oid}"'
        return self.send_content(path, entry, headers)

    def cdn(self, name, commit, path):
        entry = self.hub.repositories[name].commits[commit].get(path)
        if entry is None:
            raise RefusedError(403, "no such object")
        self.send_content(path, entry, {"ETag": f'"{entry.oid}"'})

    def send_content(self, path, entry, headers):
        size = entry.source.stat().st_size
        first, last, status = 0, size - 1, 200
        asked = re.fullmatch(r"bytes=(\d+)-(\d*)", self.headers.get("Range") or "")
        if asked:
            first, last = int(asked[1]), min(int(asked[2] or last), last)
            if first >= size:
                raise RefusedError(416, "range not satisfiable")
            status = 206
            headers = headers | {"Content-Range": f"bytes {first}-{last}/{size}"}
        rest = last - first + 1
        self.send_response(status)
        told = {"Content-Type": "application/octet-stream", "Content-Length": str(rest)}
        for header, value in {**told, **headers}.items():
            self.send_header(header, value)
        self.end_headers()
        if self.command == "HEAD":
            return
        limit = rest if self.fault is None else min(rest, self.fault.after)
        with entry.source.open("rb") as stream:
            stream.seek(first)
            while limit and (part := stream.read(min(limit, CHUNK))):
                self.wfile.write(part)
                limit -= len(part)
                with self.hub.lock:
                    self.hub.sent[path] += len(part)
        if self.fault is not None:
            self.wfile.flush()
            self.hang_up()


def listed(path, entry):
    """A file in a listing."""
    told = {
        "type": "file",
        "path": path,
        "size": entry.size,
        "oid": entry.git_oid,
    }
    if entry.lfs:
        told["lfs"] = {"oid": entry.oid, "size": entry.size, "pointerSize": 134}
    return told


def directory(path):
    """A folder in a listing."""
    oid = hashlib.sha1(path.encode()).hexdigest()
    return {"type": "directory", "path": path, "size": 0, "oid": oid}
