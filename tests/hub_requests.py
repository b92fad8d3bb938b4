"""A request to the loopback Hub: its content, its token, its fault; see `tests.hub`."""

import json
import re
import socket
from http.server import BaseHTTPRequestHandler
from urllib.parse import parse_qs, unquote, urlsplit

CHUNK = 1 << 16


class RefusedError(Exception):
    """A request that is answered by an error."""

    def __init__(self, status, message, code=None):
        super().__init__(message)
        self.status, self.code = status, code


class Requests(BaseHTTPRequestHandler):
    """One connection to a `tests.hub.Hub`; a subclass has the `routes`."""

    routes = ()

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
        """Cut the connection, with the rest of the content unread or unsent."""
        self.close_connection = True
        self.connection.shutdown(socket.SHUT_RDWR)  # close alone waits for its files

    def route(self):
        url = urlsplit(self.path)
        path = unquote(url.path)
        self.query = {name: values[0] for name, values in parse_qs(url.query).items()}
        self.hub.requests.append((self.command, path))
        self.fault = self.hub.fault_of(self.command, path)
        try:
            if self.fault and (self.fault.after is None or self.command != "GET"):
                return self.break_off()
            for methods, pattern, handle in self.routes:
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
        length = int(self.headers.get("Content-Length") or self.fault.after)
        self.rfile.read(min(length, self.fault.after))
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
            if role is None:  # whether it exists is nobody's business
                raise RefusedError(401, "Invalid username or password.")
            raise RefusedError(404, "Repository not found", "RepoNotFound")
        return found

    def commit_of(self, name, revision):
        repository = self.repository(name)
        commit = repository.resolve(revision or "main")
        if commit is None:
            raise RefusedError(404, f"Invalid rev id: {revision}", "RevisionNotFound")
        return repository, commit
