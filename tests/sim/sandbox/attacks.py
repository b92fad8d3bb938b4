"""What a hostile program may try: each returns whether it got through.

The text of this module is the program: it runs as it is, with and without a sandbox,
so that what is contained is known to bite. A test puts places of its own in `TARGETS`.
"""

import contextlib
import ctypes
import glob
import mmap
import os
import platform
import resource
import signal
import socket
import struct
import sys

import numpy as np

TARGETS = {"secret": "", "writable": "", "tcp": 0, "udp": 0, "unix": "", "package": ""}
LIBC = ctypes.CDLL(None, use_errno=True)
X86 = platform.machine() == "x86_64"


def syscall(x86, arm, *arguments):
    """Make a system call; its result, or -1."""
    number = x86 if X86 else arm
    given = [ctypes.c_long(a) if isinstance(a, int) else a for a in arguments]
    return LIBC.syscall(ctypes.c_long(number), *given)


# ---- the network


def connects_by_tcp():
    socket.create_connection(("127.0.0.1", TARGETS["tcp"]), 2).close()
    return True


def sends_udp():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end:
        return end.sendto(b"secret", ("127.0.0.1", TARGETS["udp"])) == 6


def connects_to_a_unix_socket():
    with socket.socket(socket.AF_UNIX) as end:
        end.connect(TARGETS["unix"])
    return True


def connects_to_an_abstract_socket():
    with socket.socket(socket.AF_UNIX) as end:
        end.connect("\0" + TARGETS["unix"])
    return True


def makes_a_pair_of_sockets():
    return bool(socket.socketpair())


def makes_a_raw_socket_by_number():
    return syscall(41, 198, socket.AF_INET, socket.SOCK_DGRAM, 0) >= 0


# ---- files


def reads_a_secret():
    with open(TARGETS["secret"], "rb") as file:
        return b"secret" in file.read()


def reads_the_password_file():
    with open("/etc/passwd", "rb") as file:
        return b"root" in file.read()


def reads_scenes_of_the_package():
    return any(open(path, "rb").read(1) for path in glob.glob(TARGETS["package"]))


def reads_the_environment_of_its_parent():
    for path in sorted(glob.glob("/proc/[0-9]*/environ")):
        if path.split("/")[2] != str(os.getpid()):
            with contextlib.suppress(OSError), open(path, "rb") as file:
                if file.read():
                    return True
    return False


def lists_the_home_of_the_user():
    return bool(os.listdir(os.path.dirname(TARGETS["secret"])))


def writes_outside():
    with open(os.path.join(TARGETS["writable"], "written"), "w") as file:
        file.write("x")
    return True


def writes_beside_itself():
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "w"), "w") as f:
        f.write("x")
    return True


def makes_a_folder():
    os.mkdir(os.path.join(TARGETS["writable"], "folder"))
    return True


def makes_a_file_without_a_name():
    place = os.open(TARGETS["writable"], os.O_TMPFILE | os.O_RDWR)
    return os.write(place, b"x") == 1


def makes_a_pipe_in_the_file_system():
    os.mkfifo(os.path.join(TARGETS["writable"], "fifo"))
    return True


def links_to_a_secret():
    os.symlink(TARGETS["secret"], os.path.join(TARGETS["writable"], "symlink"))
    return True


def links_hard_to_a_secret():
    os.link(TARGETS["secret"], os.path.join(TARGETS["writable"], "hard"))
    return True


def changes_the_mode_of_a_file():
    os.chmod(os.path.join(TARGETS["writable"], "mine"), 0o777)
    return True


def changes_the_owner_of_a_file():
    path = os.path.join(TARGETS["writable"], "mine")
    os.chown(path, os.getuid(), os.getgid())
    return True


def changes_the_times_of_a_file():
    os.utime(os.path.join(TARGETS["writable"], "mine"), (1, 1))
    return True


def renames_a_file():
    path = os.path.join(TARGETS["writable"], "old")
    os.rename(path, path + "er")
    return True


def removes_a_file():
    os.unlink(os.path.join(TARGETS["writable"], "doomed"))
    return True


def truncates_a_file():
    os.truncate(os.path.join(TARGETS["writable"], "mine"), 0)
    return True


def makes_its_folder_unreadable():
    os.chmod(os.path.dirname(os.path.abspath(__file__)), 0)
    return True


def keeps_memory_in_a_file():
    return os.memfd_create("hidden") >= 0


def shares_memory():
    return syscall(29, 194, 0, 1 << 20, 0o1600) >= 0  # shmget


def opens_a_file_by_its_handle():
    handle = ctypes.create_string_buffer(struct.pack("<II", 8, 1) + bytes(128))
    return syscall(304, 265, -100, handle, 0) >= 0


# ---- processes


def forks():
    pid = os.fork()
    if pid == 0:
        os._exit(0)
    os.waitpid(pid, 0)
    return True


def spawns():
    return os.posix_spawn("/bin/true", ["true"], {}) > 0


def starts_a_shell():
    pid = os.fork()
    if pid == 0:
        os.execv("/bin/sh", ["sh", "-c", "true"])
    return os.waitpid(pid, 0)[1] == 0


def starts_a_session():
    pid = os.fork()
    if pid == 0:
        os.setsid()
        os._exit(0)
    return os.waitpid(pid, 0)[1] == 0


def sends_a_signal_to_its_parent():
    os.kill(os.getppid() or -1, 0)
    return True


def sends_a_signal_to_everyone():
    for pid in (1, -1, 0):
        if pid != os.getpid():
            os.kill(pid, 0)
    return True


def traces_its_parent():
    return LIBC.ptrace(0x4206, os.getppid(), 0, 0) == 0  # PTRACE_SEIZE


def reads_the_memory_of_its_parent():
    parent = os.getppid()  # 0 where it is out of sight
    with (
        open(f"/proc/{parent}/mem", "rb") as file,
        open(f"/proc/{parent}/maps") as maps,
    ):
        file.seek(int(maps.readline().split("-")[0], 16))
        return len(file.read(16)) == 16


def reads_memory_by_number():
    data = ctypes.create_string_buffer(16)
    here = (ctypes.c_ulong * 2)(ctypes.addressof(data), 16)
    there = (ctypes.c_ulong * 2)(ctypes.addressof(data), 16)
    return syscall(310, 270, os.getpid(), here, 1, there, 1, 0) == 16


def holds_a_process():
    return os.pidfd_open(os.getpid()) >= 0


# ---- limits and privileges


def raises_its_limits():
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    return True


def lowers_a_limit():
    resource.setrlimit(resource.RLIMIT_STACK, resource.getrlimit(resource.RLIMIT_STACK))
    return True


def chooses_its_processors():
    os.sched_setaffinity(0, os.sched_getaffinity(0))
    return True


def leaves_its_namespaces():
    return LIBC.unshare(0x10000000) == 0


def mounts():
    return LIBC.mount(b"none", TARGETS["writable"].encode(), b"tmpfs", 0, None) == 0


def becomes_root():
    os.setuid(0)
    return os.getuid() == 0


def can_be_traced():
    return LIBC.prctl(4, 1, 0, 0, 0) == 0  # PR_SET_DUMPABLE


def outlives_its_parent():
    return LIBC.prctl(1, 0, 0, 0, 0) == 0  # PR_SET_PDEATHSIG


def loads_a_filter():
    return syscall(321, 280, 0, ctypes.create_string_buffer(128), 128) >= 0  # bpf


def makes_a_ring():
    return syscall(425, 425, 1, ctypes.create_string_buffer(248)) >= 0  # io_uring


def handles_faults():
    return syscall(323, 282, 1) >= 0  # userfaultfd


def counts_events():
    attributes = ctypes.create_string_buffer(struct.pack("<II", 1, 128) + bytes(120))
    return syscall(298, 241, attributes, 0, -1, -1, 0) >= 0  # perf_event_open


def types_into_a_terminal():
    return syscall(16, 29, 1, 0x5412, ctypes.create_string_buffer(b"x")) == 0  # TIOCSTI


def sets_the_clock_of_a_signal():
    return LIBC.fcntl(1, 8, os.getppid() or 1) == 0  # F_SETOWN: who gets SIGIO


def calls_from_made_code():
    if not X86:
        return syscall(0, 198, 2, 1, 0) >= 0
    page = mmap.mmap(-1, 4096, prot=mmap.PROT_READ | mmap.PROT_WRITE | mmap.PROT_EXEC)
    # mov eax, 41; mov edi, 2; mov esi, 1; xor edx, edx; syscall; ret
    page.write(bytes.fromhex("b829000000bf02000000be0100000031d20f05c3"))
    start = ctypes.addressof(ctypes.c_char.from_buffer(page))
    return ctypes.CFUNCTYPE(ctypes.c_long)(start)() >= 0


def inherits_an_open_file():
    for number in range(3, 256):
        try:
            kind = os.readlink(f"/proc/self/fd/{number}")
        except OSError:
            continue
        if not kind.startswith(("pipe:", "/proc")):
            return True
    return False


ATTACKS = [
    thing
    for thing in list(globals().values())
    if callable(thing)
    and getattr(thing, "__module__", None) == __name__
    and thing is not syscall
]


def succeeds(attack):
    """Whether an attack gets through."""
    try:
        return bool(attack())
    except (OSError, ValueError, AttributeError):
        return False


def frames():
    """One picture: a row for each attack, white if it got through."""
    signal.signal(signal.SIGIO, signal.SIG_IGN)
    sys.stdout.flush()
    found = [succeeds(attack) for attack in ATTACKS]
    yield np.repeat(np.uint8(found) * np.uint8(255), 3).reshape(-1, 1, 3)
