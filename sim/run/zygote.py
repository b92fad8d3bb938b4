"""A process that has imported what programs import, and forks for each of them.

Called as `zygote.py SOCKET`, beside `child.py`. A message on the socket is JSON: the
arguments of `child.begin` or, for a short trial, of `child.main`, and what to `become`;
it brings pipes along. The answer is the number of the new process, which leads a
session of its own. A message `about` a number is answered by how that process has
ended, or by -1 while it runs.
"""

import contextlib
import faulthandler
import gc
import importlib
import importlib.util
import json
import os
import socket
import struct
import sys
import traceback
from types import ModuleType
from typing import Any

LARGEST_MESSAGE = 1 << 16
ANSWER = struct.Struct("<q")
RUNNING = -1  # answer about a process that has not ended
GOODBYE = b"."  # follows the report when the kernels are written


def main(number: int) -> None:
    """Serve until the other end closes."""
    child = _load("child")
    for name in ("numpy", "cv2", "taichi"):
        importlib.import_module(name)
    readout = _load("readout")
    gc.freeze()
    server = socket.socket(fileno=number)
    while True:
        message, pipes, _, _ = socket.recv_fds(server, LARGEST_MESSAGE, 2)
        if not message:
            return
        arguments = json.loads(message)
        if "about" in arguments:
            server.sendall(ANSWER.pack(_ending_of(arguments["about"])))
            continue
        pid = os.fork()
        if pid == 0:
            server.close()
            kind = arguments.pop("become")
            if kind == "program":
                _become_program(child, pipes[0], pipes[1], arguments)
            if kind == "laboratory":
                _become_laboratory(child, pipes[0], pipes[1], arguments)
            if not arguments.pop("pictures"):
                arguments["read"] = readout.read_state
            _become_trial(child, pipes[0], arguments)
        for pipe in pipes:
            os.close(pipe)
        server.sendall(ANSWER.pack(pid))


def _ending_of(pid: int) -> int:
    found, status = os.waitpid(pid, os.WNOHANG)
    return status if found else RUNNING


def _load(name: str) -> ModuleType:
    """A module beside this one; the package is not imported."""
    path = os.path.join(os.path.dirname(os.path.abspath(__file__)), f"{name}.py")
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} cannot be loaded")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _become_program(
    child: ModuleType, pipe: int, printed: int, arguments: dict[str, Any]
) -> None:
    """Run one program as a fresh interpreter would; never returns."""
    code = 1
    try:
        os.setsid()
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(printed, 1)
        os.dup2(printed, 2)
        os.close(printed)
        faulthandler.enable()
        folder = os.path.dirname(arguments["path"])
        os.chdir(folder)
        os.environ["HOME"] = os.environ["TMPDIR"] = folder
        child.begin(arguments | {"pipe": pipe})
        code = 0
    except SystemExit as error:
        code = error.code if isinstance(error.code, int) else bool(error.code)
    except BaseException:
        traceback.print_exc()
        raise
    finally:
        with contextlib.suppress(OSError, ValueError):  # it may have closed them
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code & 255)


def _become_trial(child: ModuleType, pipe: int, arguments: dict[str, Any]) -> None:
    """Run one linked program for its states; never returns."""
    code = 1
    try:
        _settle(arguments.pop("log"), os.path.dirname(arguments["path"]))
        os.environ["TI_OFFLINE_CACHE_FILE_PATH"] = arguments.pop("kernels")
        os.environ |= {"TI_OFFLINE_CACHE": "1", "TI_NUM_COMPILE_THREADS": "0"}
        child.confine(arguments["memory"])
        child.main(pipe=pipe, **arguments)
        importlib.import_module("taichi").reset()  # which writes the kernels
        os.write(pipe, GOODBYE)
        code = 0
    finally:
        os._exit(code)


def _become_laboratory(
    child: ModuleType, pipe: int, requests: int, arguments: dict[str, Any]
) -> None:
    """Run linked programs one after the other, as they are asked for; never returns."""
    code = 1
    try:
        _settle(arguments["log"], os.path.dirname(arguments["log"]))
        child.confine(arguments["memory"])
        _load("shelf").serve(child, requests, pipe, arguments["memory"])
        code = 0
    finally:
        os._exit(code)


def _settle(log: str, folder: str) -> None:
    """Lead a session, compile soon, print into a file, and work in a folder."""
    os.setsid()
    gc.disable()
    _load("quick").quicken()
    printed = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(printed, 1)
    os.dup2(printed, 2)
    os.chdir(folder)


if __name__ == "__main__":
    main(int(sys.argv[1]))
