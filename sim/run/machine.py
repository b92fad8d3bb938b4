"""What this machine can do for the package, and what each thing that it lacks costs."""

import os
import platform
import resource
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final, NamedTuple

import cv2
import numpy as np

from mpmworlds.sim.run.encode import CODEC, decode_mp4, encode_mp4
from mpmworlds.sim.run.process import LEAST_MEMORY
from mpmworlds.sim.run.run import SandboxError, run
from mpmworlds.sim.run.torchcodec import judge_torchcodec
from mpmworlds.sim.scene.palette import PALETTE, rgb

PROGRAM: Final = """\
import numpy as np

def frames():
    yield np.zeros((1, 1, 3), np.uint8)
"""
PROCESS: Final = (
    4 << 30
)  # bytes of memory that a process which renders and scores takes
ROOM: Final = 2 << 30  # bytes that scratch files and a small corpus take
EXTRAS: Final = {
    "ray": ("cluster", "no work on several machines: --ray"),
    "openai": ("llm", "no scenes from a language model: mpmworlds propose"),
    "matplotlib": ("plots", "no figures: mpmworlds stats --figure"),
    "torch": ("small", "no tensors, no learned baseline: mpmworlds train small"),
    "transformers": ("vlm", "no programs by Qwen2.5-VL: mpmworlds train vlm"),
    "diffusers": ("vdm", "no continuation by diffusion: mpmworlds train vdm"),
}


class Check(NamedTuple):
    """One thing that was looked at."""

    what: str
    found: str  # on this machine
    good: bool
    needed: bool  # whether the package is of little use without it
    costs: str  # what is lost without it, and what would help; empty if it is good


def examine(folder: Path) -> Iterator[Check]:
    """Look at what the package uses.

    Parameters
    ----------
    folder
        Where corpora and results are to lie.

    Yields
    ------
    Check
        One at a time: some take a second.
    """
    yield from _sandbox()
    yield from _renderer()
    yield from _room(folder)
    graphics = _graphics()
    costs = (
        "the label model trains for hours, not one; the paper's two models not at all"
    )
    yield Check("GPU", graphics or "none", bool(graphics), False, _if(graphics, costs))
    for name, (extra, costs) in EXTRAS.items():
        found = _version(name)
        advice = f'{costs}; pip install "mpmworlds[{extra}]"'
        yield Check(name, found or "not there", bool(found), False, _if(found, advice))


def _if(good: object, costs: str) -> str:
    return "" if good else costs


def _sandbox() -> Iterator[Check]:
    try:
        seal = run(PROGRAM, timeout=60).sandbox or {}
        refused = ""
    except SandboxError as error:
        seal, refused = {}, str(error)
    yield Check(
        "sandbox",
        "works" if seal else "does not work",
        bool(seal),
        True,
        _if(seal, f"no programs but those of scenes can be run: {refused}"),
    )
    landlock = seal.get("landlock", 0)
    yield Check(
        "sandbox: Landlock",
        f"version {landlock}" if landlock else "none",
        landlock > 0,
        False,
        _if(landlock, "files are hidden by namespaces alone; it takes Linux 5.13"),
    )
    names = seal.get("namespaces", ())
    yield Check(
        "sandbox: namespaces",
        ", ".join(sorted(names)) or "none",
        "mount" in names,
        False,
        _if(
            "mount" in names,
            "lockdown is the only layer; let users have namespaces "
            "(sysctl user.max_user_namespaces, kernel.unprivileged_userns_clone), or "
            "start the container with --security-opt seccomp=unconfined",
        ),
    )


def _renderer() -> Iterator[Check]:
    yield Check("Python", platform.python_version(), True, True, "")
    known = platform.machine() in ("x86_64", "AMD64")
    yield Check(
        "processor",
        f"{platform.machine()}, {os.cpu_count()} cores",
        known,
        False,
        _if(known, "videos may differ in their last bits from those of a release"),
    )
    yield Check("compiler", f"taichi {version('taichi')}", True, True, "")
    frame = np.zeros((16, 16, 3), np.uint8)
    frame[4:12, 4:12] = rgb(next(iter(PALETTE.values())))
    video = encode_mp4(np.stack([frame] * 3), 30)
    exact = bool((decode_mp4(video) == frame).all())
    yield Check(
        "exact videos",
        f"{CODEC} by PyAV {version('av')}, read by OpenCV {cv2.__version__}",
        exact,
        True,
        _if(exact, "no release can be read or built; install the pinned av and OpenCV"),
    )
    decodes, told = judge_torchcodec(video)
    yield Check(
        "torchcodec",
        told,
        decodes,
        False,
        _if(
            decodes,
            "datasets.Video() decodes nothing, or not exactly; mpmworlds.load, OpenCV "
            "and PyAV decode exactly (with torch on a GPU, decode on the CPU)",
        ),
    )
    preview = _writes_previews()
    yield Check(
        "videos of `python program.py`",
        "WebM, VP8" if preview else "not written",
        preview,
        False,
        _if(preview, "a program on its own writes no preview; frames() still works"),
    )


def _graphics() -> str:
    """Names and memory of the GPUs of this machine, as its driver tells them."""
    tool = shutil.which("nvidia-smi")
    if tool is None:
        return ""
    asked = [tool, "--query-gpu=name,memory.total", "--format=csv,noheader"]
    try:
        told = subprocess.run(
            asked, capture_output=True, text=True, timeout=30, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"not told ({error})"
    return "; ".join(told.stdout.splitlines())


def _writes_previews() -> bool:
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "preview.webm")
        code = cv2.VideoWriter.fourcc(*"VP80")
        writer = cv2.VideoWriter(path, code, 30.0, (16, 16))
        for _ in range(3):
            writer.write(np.zeros((16, 16, 3), np.uint8))
        writer.release()
        return os.path.isfile(path) and os.path.getsize(path) > 0


def _room(folder: Path) -> Iterator[Check]:
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    if hard != resource.RLIM_INFINITY:
        yield Check(
            "address space of a process",
            f"{hard >> 20} MiB",
            hard >= LEAST_MEMORY,
            True,
            _if(hard >= LEAST_MEMORY, "no program runs; raise `ulimit -v` to 4 GiB"),
        )
    pages = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    most = max(pages // PROCESS, 1)
    enough = most >= (os.cpu_count() or 1)
    yield Check(
        "memory",
        f"{pages / (1 << 30):.0f} GiB",
        enough,
        False,
        _if(enough, f"take --workers {most}: each may need {PROCESS >> 30} GiB"),
    )
    for what, place in (
        ("scratch files", Path(tempfile.gettempdir())),
        ("work", folder),
    ):
        free = shutil.disk_usage(_existing(place)).free
        yield Check(
            f"disk for {what}",
            f"{free / (1 << 30):.1f} GiB free in {place}",
            free >= ROOM,
            True,
            _if(
                free >= ROOM,
                "runs will stop for lack of room; free some, or set TMPDIR",
            ),
        )


def _existing(place: Path) -> Path:
    return next(p for p in (place.absolute(), *place.absolute().parents) if p.exists())


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
