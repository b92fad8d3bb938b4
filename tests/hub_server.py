"""The requests that the loopback Hub answers; see `tests.hub`."""

import base64
import hashlib
import json
import os
import re
import secrets
import socket
from http.server import BaseHTTPRequestHandler
from urllib.parse import parse_qs, unquote, urlsplit

import yaml

REPOSITORY = r"(?P<name>[^/]+/[^/]+)"
API = f"/api/datasets/{REPOSITORY}"
CHUNK = 1 << 16


class RefusedError(Exception):
    """A request that is answered by an error."""

    def __init__(self, status, message, code=None):
        super().__init__(message)
        self.status, self.code = status, code


class Handler(BaseHTTPRequestHandler):
    """One connection to a `tests.hub.Hub`."""

    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True

    def log_message(self, *arguments):
        """Keep the test output clean."""

    @property
    def hub(self):
        return self.server.hub

    # ---- reading and answering

    def body(self):
        return b"".join(self.chunks())

    def chunks(self):
        """Content of the request, in parts, with or without a length told."""
        if self.headers.get("Transfer-Encoding") == "chunked":
            while length := int(self.rfile.readline().strip(), 16):
                yield self.rfile.read(length)
                self.rfile.readline()
            self.rfile.readline()
        rest = int(self.headers.get("Content-Length") or 0)
        while rest > 0 and (part := self.rfile.read(min(rest, CHUNK))):
            rest -= len(part)
            yield part

    def answer(self, status, content=b"", headers=()):
        body = content if isinstance(content, bytes) else json.dumps(content).encode()
        self.send_response(status)
        told = {"Content-Type": "application/json", "Content-Length": str(len(body))}
        for name, value in {**told, **dict(headers)}.items():
            self.send_header(name, value)
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def hang_up(self):
        """Cut the connection as a broken line does: reset, not closed."""
        self.close_connection = True
        linger = (1).to_bytes(4, "little") + (0).to_bytes(4, "little")
        self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
        self.connection.close()

    def route(self):
        url = urlsplit(self.path)
        path = unquote(url.path)
        self.query = {name: values[0] for name, values in parse_qs(url.query).items()}
        self.hub.requests.append((self.command, path))
        self.fault = self.hub.fault_of(self.command, path)
        try:
            if self.fault and (self.fault.after is None or self.command != "GET"):
                return self.break_off()
            for methods, pattern, handle in ROUTES:
                found = re.fullmatch(pattern, path)
                if found and self.command in methods.split():
                    return handle(self, **found.groupdict())
            self.body()
            raise RefusedError(404, f"{self.command} {path}: no such page", "NotFound")
        except RefusedError as refused:
            code = {"X-Error-Code": refused.code} if refused.code else {}
            headers = {**code, "X-Error-Message": str(refused)}
            self.answer(refused.status, {"error": str(refused)}, headers)
        except (ConnectionError, TimeoutError):
            self.close_connection = True

    do_GET = do_HEAD = do_POST = do_PUT = do_DELETE = route

    def break_off(self):
        if self.fault.after is None:
            self.body()
            return self.answer(
                self.fault.status, self.fault.content, self.fault.headers
            )
        self.rfile.read(self.fault.after)
        return self.hang_up()

    # ---- who asks, and for what

    def token(self):
        """The token's role; None without one."""
        told = self.headers.get("Authorization")
        if told is None:
            return None
        token = told.removeprefix("Bearer ")
        if token == "hf_expired":
            raise RefusedError(401, 'User Access Token "test" is expired')
        if token not in self.hub.tokens:
            raise RefusedError(401, "Invalid credentials in Authorization header")
        return self.hub.tokens[token]

    def check_writer(self, name):
        role = self.token()
        if role is None:
            raise RefusedError(401, "Invalid username or password.")
        if role != "write" or name.partition("/")[0] not in ("tester", "acme"):
            raise RefusedError(
                403, f"You don't have the rights to write to the repo {name}"
            )

    def repository(self, name):
        role = self.token()
        found = self.hub.repositories.get(name)
        if found is None or (found.private and role is None):
            raise RefusedError(404, "Repository not found", "RepoNotFound")
        return found

    def commit_of(self, name, revision):
        repository = self.repository(name)
        commit = repository.resolve(revision or "main")
        if commit is None:
            raise RefusedError(404, f"Invalid rev id: {revision}", "RevisionNotFound")
        return repository, commit

    # ---- accounts and repositories

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

    def validate(self):
        text = json.loads(self.body())["content"]
        errors = []
        try:
            told = yaml.safe_load(text.split("---\n")[1]) if "---\n" in text else {}
            if not isinstance(told, dict):
                errors = [{"message": "must be a mapping"}]
        except yaml.YAMLError as error:
            errors = [{"message": str(error)}]
        self.answer(400 if errors else 200, {"errors": errors, "warnings": []})

    def create(self):
        told = json.loads(self.body())
        name = f"{told.get('organization') or 'tester'}/{told['name']}"
        self.check_writer(name)
        status = 409 if name in self.hub.repositories else 200
        if status == 200:
            private = told.get("private") or told.get("visibility") == "private"
            self.hub.create(name, bool(private))
        url = f"{self.hub.url}/datasets/{name}"
        self.answer(status, {"url": url, "name": name, "id": name})

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

    def tag(self, name, revision):
        told = json.loads(self.body() or b"{}")
        self.check_writer(name)
        repository = self.repository(name)
        if self.command == "DELETE":
            repository.tags.pop(revision, None)
            return self.answer(200, {})
        _, commit = self.commit_of(name, revision)
        if told["tag"] in repository.tags:
            raise RefusedError(409, "Tag reference exists already")
        repository.tags[told["tag"]] = commit
        return self.answer(200, {})

    # ---- uploads

    def preupload(self, name, revision):
        told = json.loads(self.body())
        self.check_writer(name)
        repository, commit = self.commit_of(name, revision)
        files = []
        for file in told["files"]:
            path = file["path"]
            mode = "lfs" if self.hub.is_lfs(path, file["size"]) else "regular"
            found = repository.commits[commit].get(path)
            files.append(
                {
                    "path": path,
                    "uploadMode": mode,
                    "shouldIgnore": False,
                    "oid": found.oid if found else None,
                }
            )
        self.answer(200, {"files": files})

    def lfs_batch(self, name):
        told = json.loads(self.body())
        self.check_writer(name)
        objects = []
        for asked in told["objects"]:
            href = f"{self.hub.url}/_lfs/{asked['oid']}"
            actions = {"upload": {"href": href}, "verify": {"href": f"{href}/verify"}}
            missing = not self.hub.blob(asked["oid"]).exists()
            objects.append({**asked, **({"actions": actions} if missing else {})})
        self.answer(200, {"transfer": "basic", "objects": objects})

    def lfs_put(self, oid):
        digest = hashlib.sha256()
        part = self.hub.folder / f".{oid}.{secrets.token_hex(4)}"
        with part.open("wb") as stream:
            for chunk in self.chunks():
                stream.write(chunk)
                digest.update(chunk)
                self.hub.received[oid] += len(chunk)
        if digest.hexdigest() != oid:
            part.unlink()
            raise RefusedError(400, "sha256 mismatch")
        os.replace(part, self.hub.blob(oid))
        self.answer(200)

    def lfs_verify(self, oid):
        told = json.loads(self.body())
        blob = self.hub.blob(oid)
        whole = blob.exists() and blob.stat().st_size == told["size"]
        self.answer(200 if whole else 404, {})

    def commit(self, name, revision):
        lines = [json.loads(line) for line in self.body().splitlines() if line.strip()]
        self.check_writer(name)
        with self.hub.lock:
            repository, parent = self.commit_of(name, revision)
            head = lines[0]["value"]
            if head.get("parentCommit") not in (None, parent):
                raise RefusedError(412, "A commit has happened since.")
            files = dict(repository.commits[parent])
            for line in lines[1:]:
                self.apply(files, line["key"], line["value"])
            commit = repository.commit(files, head["summary"], revision)
        url = f"{self.hub.url}/datasets/{name}/commit/{commit}"
        self.answer(
            200,
            {"success": True, "commitOid": commit, "commitUrl": url, "hookOutput": ""},
        )

    def apply(self, files, key, told):
        path = told["path"]
        if key == "file":
            files[path] = self.hub.keep(path, base64.b64decode(told["content"]))
        elif key == "lfsFile":
            if not self.hub.blob(told["oid"]).exists():
                raise RefusedError(400, f"LFS object {told['oid']} does not exist")
            files[path] = self.hub.entry_of(path, self.hub.blob(told["oid"]))
        elif key == "deletedFile":
            files.pop(path, None)
        elif key == "deletedFolder":
            for below in [p for p in files if p.startswith(path.rstrip("/") + "/")]:
                del files[below]

    # ---- listings and downloads

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


REVISION = "(?P<revision>[^/]+)"
ROUTES = (
    ("GET", "/api/whoami-v2", Handler.whoami),
    ("POST", "/api/validate-yaml", Handler.validate),
    ("POST", "/api/repos/create", Handler.create),
    ("POST", f"{API}/preupload/{REVISION}", Handler.preupload),
    ("POST", rf"/datasets/{REPOSITORY}\.git/info/lfs/objects/batch", Handler.lfs_batch),
    ("PUT", "/_lfs/(?P<oid>[0-9a-f]{64})", Handler.lfs_put),
    ("POST", "/_lfs/(?P<oid>[0-9a-f]{64})/verify", Handler.lfs_verify),
    ("POST", f"{API}/commit/{REVISION}", Handler.commit),
    ("POST DELETE", f"{API}/tag/(?P<revision>.+)", Handler.tag),
    ("GET", f"{API}/refs", Handler.refs),
    ("GET", f"{API}/commits/{REVISION}", Handler.history),
    ("GET", f"{API}/tree/{REVISION}(?P<below>/.*)?", Handler.tree),
    ("POST", f"{API}/paths-info/{REVISION}", Handler.paths_info),
    ("GET", f"{API}(?:/revision/(?P<revision>.+))?", Handler.info),
    (
        "GET HEAD",
        f"/datasets/{REPOSITORY}/resolve/{REVISION}/(?P<path>.+)",
        Handler.resolve,
    ),
    ("GET HEAD", f"/_cdn/{REPOSITORY}/(?P<commit>[^/]+)/(?P<path>.+)", Handler.cdn),
)
