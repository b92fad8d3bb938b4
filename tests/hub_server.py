"""What the loopback Hub takes in, and all its addresses; see `tests.hub`."""

import base64
import hashlib
import json
import os
import secrets

import yaml

from tests.hub_downloads import Downloads
from tests.hub_requests import RefusedError

REPOSITORY = r"(?P<name>[^/]+/[^/]+)"
API = f"/api/datasets/{REPOSITORY}"


class Handler(Downloads):
    """Repositories, tags, blobs and commits."""

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


REVISION = "(?P<revision>[^/]+)"
Handler.routes = (
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
