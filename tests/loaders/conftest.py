"""A Hub on the loopback interface: as much of one as ``load_dataset`` talks to."""

import hashlib
import json
import re
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import SimpleNamespace
from urllib.parse import parse_qs, unquote, urlsplit

import pytest

REPOSITORY = "acme/mpmworlds"
COMMIT = "c" * 40
REVISIONS = {"main", "v1.2.3", COMMIT}


class Handler(BaseHTTPRequestHandler):
    """Serves one folder as the repository ``REPOSITORY``, read-only."""

    protocol_version = "HTTP/1.1"

    def log_message(self, *arguments):
        """Keep the test output clean."""

    def answer(self, status, content=b"", headers=()):
        body = content if isinstance(content, bytes) else json.dumps(content).encode()
        self.send_response(status)
        for name, value in {"Content-Length": str(len(body)), **dict(headers)}.items():
            self.send_header(name, value)
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def refuse(self, code):
        self.answer(404, {"error": code}, {"X-Error-Code": code})

    def entry(self, path):
        if path not in self.server.files:
            return {"type": "directory", "path": path, "size": 0, "oid": "0" * 40}
        data = (self.server.folder / path).read_bytes()
        return {
            "type": "file",
            "path": path,
            "size": len(data),
            "oid": hashlib.sha1(data).hexdigest(),
        }

    def route(self):
        length = int(self.headers.get("Content-Length") or 0)
        body = self.rfile.read(length).decode()
        path = unquote(urlsplit(self.path).path)
        self.server.requests.append((self.command, path))
        api = re.fullmatch(
            rf"/api/datasets/{REPOSITORY}(?:/(revision|tree|paths-info)/([^/]+)(.*))?",
            path,
        )
        file = re.fullmatch(rf"/datasets/{REPOSITORY}/resolve/([^/]+)/(.+)", path)
        if not api and not file:
            return self.refuse("RepoNotFound")
        revision = (api[2] if api else file[1]) or "main"
        if revision not in REVISIONS:
            return self.refuse("RevisionNotFound")
        if file:
            return self.send_content(file[2])
        return self.send_listing(api[1], api[3] or "", body)

    def send_listing(self, kind, below, body):
        files = self.server.files
        if kind == "tree":
            start = below.strip("/") + "/" if below.strip("/") else ""
            found = [path for path in files if path.startswith(start)]
            if not found:
                return self.refuse("EntryNotFound")
            if "recursive=true" not in self.path.lower():
                depth = start.count("/") + 1
                found = {"/".join(path.split("/")[:depth]) for path in found}
            return self.answer(200, [self.entry(path) for path in sorted(found)])
        if kind == "paths-info":
            asked = json.loads(body) if body[:1] == "{" else parse_qs(body)
            found = [
                self.entry(path)
                for path in asked["paths"]
                if any(file == path or file.startswith(f"{path}/") for file in files)
            ]
            return self.answer(200, found)
        return self.answer(
            200,
            {
                "id": REPOSITORY,
                "sha": COMMIT,
                "private": False,
                "gated": False,
                "disabled": False,
                "tags": [],
                "downloads": 0,
                "likes": 0,
                "siblings": [{"rfilename": path} for path in files],
            },
        )

    def send_content(self, path):
        headers = {"X-Repo-Commit": COMMIT, "Accept-Ranges": "bytes"}
        if path not in self.server.files:
            return self.answer(404, b"", {**headers, "X-Error-Code": "EntryNotFound"})
        data = (self.server.folder / path).read_bytes()
        headers["ETag"] = f'"{hashlib.sha1(data).hexdigest()}"'
        asked = re.fullmatch(r"bytes=(\d+)-(\d*)", self.headers.get("Range") or "")
        if not asked:
            return self.answer(200, data, headers)
        start, stop = int(asked[1]), min(int(asked[2] or len(data)) + 1, len(data))
        headers["Content-Range"] = f"bytes {start}-{stop - 1}/{len(data)}"
        return self.answer(206, data[start:stop], headers)

    do_GET = do_HEAD = do_POST = route


@pytest.fixture(scope="session")
def hub(release):
    """Loopback Hub that holds the release as ``acme/mpmworlds``: url, requests."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    server.folder = release
    server.files = sorted(
        str(path.relative_to(release)) for path in release.rglob("*") if path.is_file()
    )
    server.requests = []
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    host, port = server.server_address
    yield SimpleNamespace(url=f"http://{host}:{port}", requests=server.requests)
    server.shutdown()
    server.server_close()
    thread.join()
