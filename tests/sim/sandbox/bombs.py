"""Programs that use up what they can, or lie about what they do.

Each with the outcomes that it may have, and whether it gives frames.
"""

from typing import NamedTuple

HEAD = """\
import ctypes, json, os, resource, signal, struct, sys, threading, time
import numpy as np

IMAGE = np.zeros((4, 4, 3), np.uint8)
HEADER = struct.Struct("<4sIIQ")

def pipe():
    for number in range(3, 64):
        try:
            if os.readlink(f"/proc/self/fd/{number}").startswith("pipe:"):
                return number
        except OSError:
            try:
                os.fstat(number)
                return number
            except OSError:
                pass

def send(kind, one, other, payload, length=None):
    head = HEADER.pack(kind, one, other, len(payload) if length is None else length)
    os.write(pipe(), head + payload)

def frames():
    yield IMAGE
"""


class Bomb(NamedTuple):
    """A program, how it may end, and how long [s] it may take beside other work."""

    body: str
    statuses: tuple[str, ...]
    seconds: int = 6


def _threads(start):
    return f"""
    count = 0
    stop = time.monotonic() + 3
    threading.stack_size(65536)
    try:
        while time.monotonic() < stop:
            {start}
            count += 1
    except (RuntimeError, MemoryError):
        pass
    yield np.full((4, 4, 3), min(count, 255), np.uint8)
"""


BOMBS = {
    "a loop without end": Bomb("    while True: pass\n", ("timeout",)),
    "a sleep": Bomb("    time.sleep(999)\n", ("timeout",)),
    "a loop that ignores all signals": Bomb(
        "    for n in range(1, 65):\n"
        "        try: signal.signal(n, signal.SIG_IGN)\n"
        "        except (OSError, ValueError): pass\n"
        "    while True: pass\n",
        ("timeout",),
    ),
    "it stops itself": Bomb(
        "    os.kill(os.getpid(), signal.SIGSTOP)\n    while True: pass\n", ("timeout",)
    ),
    "a kernel without end": Bomb(
        "    import taichi as ti\n    ti.init(arch=ti.cpu)\n"
        "    globals()['ti'] = ti\n    endless()\n",
        ("timeout", "exception"),
    ),
    "memory": Bomb(
        "    kept = [bytearray(1 << 28) for _ in range(99)]\n",
        ("out_of_memory",),
        seconds=40,  # a machine with other work writes 4 GiB slowly
    ),
    "memory by mmap": Bomb(
        "    import mmap\n    kept = [mmap.mmap(-1, 1 << 30) for _ in range(99)]\n",
        ("exception", "out_of_memory"),
    ),
    "threads": Bomb(
        _threads("threading.Thread(target=time.sleep, args=(9,), daemon=True).start()"),
        ("ok",),
    ),
    "what it prints": Bomb(
        "    while True: print('x' * 2**20)\n", ("too_much_output",)
    ),
    "what it prints, in drops": Bomb(
        "    while True:\n        print('x', flush=True)\n        time.sleep(0.01)\n",
        ("timeout",),
    ),
    "frames without end": Bomb(
        "    while True: yield IMAGE\n", ("timeout", "too_much_output")
    ),
    "large frames": Bomb(
        "    while True: yield IMAGE\n",
        ("too_much_output",),
        seconds=20,  # for 1 GiB through a pipe
    ),
    "a frame that is too large": Bomb(
        "    yield np.zeros((1, 20000, 3), np.uint8)\n", ("bad_frames",)
    ),
    "recursion": Bomb("    f = lambda: f()\n    f()\n", ("exception",)),
    "recursion in C": Bomb(
        "    sys.setrecursionlimit(10**9)\n    f = lambda: f()\n    f()\n",
        ("crash", "exception", "out_of_memory", "timeout", "killed"),
    ),
    "a fault": Bomb("    ctypes.string_at(0)\n", ("crash",)),
    "all descriptors closed": Bomb(
        "    os.closerange(0, 256)\n    time.sleep(999)\n", ("timeout", "crash")
    ),
    "calls of another architecture": Bomb(
        "    import mmap, platform\n"
        "    if platform.machine() != 'x86_64': os.kill(os.getpid(), 31)\n"
        "    p = mmap.mmap(-1, 4096, prot=7)\n"
        "    p.write(bytes.fromhex('b814000000cd80c3'))\n"
        "    a = ctypes.addressof(ctypes.c_char.from_buffer(p))\n"
        "    ctypes.CFUNCTYPE(ctypes.c_long)(a)()\n"
        "    time.sleep(1)\n",
        ("forbidden", "crash"),
    ),
    "another program": Bomb(
        "    os.execv('/bin/sleep', ['sleep', '99'])\n",
        ("forbidden", "exception"),
    ),
    "a claim to have ended well": Bomb(
        '    send(b\'REPT\', 0, 0, b\'{"status": "ok", "message": ""}\')\n'
        "    time.sleep(999)\n",
        ("ok",),
    ),
    "an unknown kind of message": Bomb(
        "    send(b'EVIL', 0, 0, b'x')\n    time.sleep(99)\n", ("bad_message",)
    ),
    "bytes that are no message": Bomb(
        "    os.write(pipe(), os.urandom(1 << 16))\n    time.sleep(99)\n",
        ("bad_message", "bad_frames"),
    ),
    "a length without end": Bomb(
        "    send(b'FRAM', 4, 4, b'', 1 << 63)\n    time.sleep(99)\n", ("bad_frames",)
    ),
    "a frame of another length": Bomb(
        "    send(b'FRAM', 4, 4, b'x' * 47)\n    time.sleep(99)\n", ("bad_frames",)
    ),
    "half a message": Bomb(
        "    os.write(pipe(), HEADER.pack(b'FRAM', 4, 4, 48) + b'x')\n"
        "    os._exit(0)\n",
        ("crash",),
    ),
    "a report that is no JSON": Bomb(
        "    send(b'REPT', 0, 0, b'{')\n    time.sleep(99)\n", ("bad_message",)
    ),
    "a report that is deep": Bomb(
        "    send(b'REPT', 0, 0, b'[' * 60000)\n    time.sleep(99)\n", ("bad_message",)
    ),
    "a report that is a list": Bomb(
        "    send(b'REPT', 0, 0, b'[]')\n    time.sleep(99)\n", ("bad_message",)
    ),
    "a report of an unknown kind": Bomb(
        '    send(b\'REPT\', 0, 0, b\'{"status": "fine", "message": ""}\')\n'
        "    time.sleep(99)\n",
        ("bad_message",),
    ),
    "a report that is long": Bomb(
        "    send(b'REPT', 0, 0, b'{}' + b' ' * (1 << 20))\n    time.sleep(99)\n",
        ("bad_message",),
    ),
    "a state that was not asked for": Bomb(
        "    send(b'STAT', 1 << 31, 0, b'', 24 << 31)\n    time.sleep(99)\n",
        ("too_much_output", "bad_message"),
    ),
    "a second seal": Bomb(
        "    send(b'SEAL', 0, 0, b'{}')\n    time.sleep(99)\n", ("bad_message",)
    ),
    "a log that is none": Bomb(
        "    for name in os.listdir('.'):\n"
        "        try: os.unlink(name)\n"
        "        except OSError: pass\n"
        "    os.mkfifo('log')\n    raise ValueError\n",
        ("exception", "forbidden"),
    ),
    "a message for the terminal": Bomb(
        "    raise ValueError('\\x1b]0;owned\\x07\\x1b[2J')\n", ("exception",)
    ),
    "a runner that is another": Bomb(
        "    runner = sys._getframe(1).f_globals\n"
        "    runner['_send_json'] = lambda *a: None\n    runner['_write'] = None\n",
        ("crash", "exception"),
    ),
}
