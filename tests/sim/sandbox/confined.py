"""Run programs as another user, or where the kernel has no namespaces, or the like.

    python confined.py '{"user": N, "deny": [system calls], "forked": BOOL}' < PROGRAMS

PROGRAMS is a JSON list of `{"text", "timeout", "trusted"}`; the answer a list of
`{"status", "message", "frames", "seconds", "seal", "left"}`, with the processes that
are left of each. A program that has `TARGETS` gets places to try itself on.
"""

import ctypes
import errno
import json
import os
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import ExitStack
from pathlib import Path

from mpmworlds.sim.run import run as module
from mpmworlds.sim.run.forkserver import ForkServer
from mpmworlds.sim.run.running import Running
from mpmworlds.sim.run.sandbox import libc, seccomp, syscalls

PROJECT = Path(__file__).resolve().parents[3]


def main():
    """Become what is asked for, run the programs, and answer."""
    settings = json.loads(sys.argv[1])
    if settings.get("user"):
        make_reachable({Path(sys.base_prefix), Path(sys.prefix), PROJECT})
        os.setgroups([])
        os.setresgid(*[settings["user"]] * 3)
        os.setresuid(*[settings["user"]] * 3)
    if settings.get("deny"):
        deny(settings["deny"])
    with tempfile.TemporaryDirectory() as folder:
        tempfile.tempdir = folder
        targets = make_targets(Path(folder))
        with ExitStack() as stack:
            server = settings.get("forked") and stack.enter_context(ForkServer())
            programs = json.load(sys.stdin)
            answers = [answer(p, targets, folder, server) for p in programs]
        os.chmod(folder, 0o700)
    json.dump(answers, sys.stdout)


def answer(program, targets, folder, server):
    """Run one program."""
    text = program["text"].replace("TARGETS = {", f"TARGETS = {targets} or {{", 1)
    start = time.monotonic()
    try:
        with Running(
            text,
            timeout=program.get("timeout", 60),
            trusted=program.get("trusted", False),
            server=server,
        ) as running:
            outcome = running.go_on()
        found = {"status": outcome.status, "message": outcome.message}
        found["frames"] = outcome.frames[-9:, :99, :9].tolist()
        found["seal"] = outcome.sandbox
    except module.SandboxError as error:
        found = {"status": "SandboxError", "message": str(error), "frames": []}
    found["seconds"] = time.monotonic() - start
    return found | {"left": left(folder)}


def left(folder):
    """What runs a moment from now of programs that lie in a folder."""
    time.sleep(0.3)
    return running_in(folder)


def running_in(folder):
    """What runs of programs that lie in a folder."""
    command = ["ps", "-e", "-ww", "-o", "pid=,stat=,args="]
    listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    rows = [line.split(None, 2) for line in listed.splitlines()]
    return [
        " ".join(row)
        for row in rows
        if not is_over(row) and str(folder) in row[-1] + home_of(row[0])
    ]


def is_over(row):
    """Whether a process has ended, or has no memory left."""
    return row[1].startswith("Z") or row[-1].startswith("[")


def home_of(pid):
    """Folder that a process is in; what was forked does not name it."""
    try:
        return os.readlink(f"/proc/{pid}/cwd")
    except OSError:  # it has ended, or is another user's
        return ""


def make_targets(folder):
    """A secret, files to spoil, and servers that listen."""
    home, writable = folder / "home", folder / "writable"
    for place in (home, writable):
        place.mkdir()
    (home / "secret").write_text("a secret")
    for name in ("mine", "old", "doomed"):
        (writable / name).write_text("mine")
    tcp = socket.create_server(("127.0.0.1", 0))
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    udp.bind(("127.0.0.1", 0))
    path = str(folder / "socket")
    listening = [tcp, udp]
    for name in (path, "\0" + path):
        end = socket.socket(socket.AF_UNIX)
        end.bind(name)
        end.listen()
        listening.append(end)
    for end in (tcp, *listening[2:]):
        threading.Thread(target=accept, args=(end,), daemon=True).start()
    make_targets.kept = listening
    root = Path(module.__file__).resolve().parents[2]
    return {
        "secret": str(home / "secret"),
        "writable": str(writable),
        "tcp": tcp.getsockname()[1],
        "udp": udp.getsockname()[1],
        "unix": path,
        "package": str(root / "builder" / "recorded" / "*.parquet"),
    }


def accept(end):
    """Welcome everybody."""
    while True:
        end.accept()[0].close()


def deny(names):
    """Fail system calls from now on, here and in what is started, as Docker does."""
    column = syscalls.machine().column
    code = [seccomp._load(seccomp.NUMBER_AT)]
    for name in names:
        number = next(
            t[name][column]
            for t in (syscalls.ALLOWED, syscalls.FILTERED, syscalls.SETUP)
            if name in t
        )
        lacks = errno.ENOSYS if name.startswith("landlock") else errno.EPERM
        code += [
            seccomp._if(seccomp.EQUAL, number, 0, 1),
            seccomp._return(seccomp.ERRNO | lacks),
        ]
    code.append(seccomp._return(seccomp.ALLOW))
    data = b"".join(code)
    buffer = ctypes.create_string_buffer(data, len(data))
    filters = struct.pack("HxxxxxxP", len(code), ctypes.addressof(buffer))
    libc.prctl(libc.PR_SET_NO_NEW_PRIVS, 1)
    number = syscalls.number("seccomp")
    libc.syscall(number, seccomp.SET_MODE_FILTER, 0, ctypes.c_char_p(filters))


def make_reachable(places):
    """Let other users reach folders below ones that are the superuser's own."""
    inside = {}  # outermost closed folder -> what is to be reached in it
    for place in places:
        closed = [p for p in place.parents if not p.stat().st_mode & 0o001]
        if closed:
            inside.setdefault(closed[-1], set()).add(place)
    if not inside:
        return
    libc.unshare(0x00020000)
    libc.mount("none", "/", "none", 16384 | (1 << 18))
    for top, wanted in inside.items():
        kept = tempfile.mkdtemp()
        os.chmod(kept, 0o755)
        for place in sorted(wanted):
            if not wanted.isdisjoint(place.parents):
                continue
            inner = Path(kept, place.relative_to(top))
            inner.mkdir(parents=True)
            libc.mount(str(place), str(inner), "none", 4096 | 16384)
        libc.mount(kept, str(top), "none", 4096 | 16384)
    os.chdir("/")


if __name__ == "__main__":
    main()
