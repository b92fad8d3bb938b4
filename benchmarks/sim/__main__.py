"""Measure the simulator and print its tables as Markdown.

    python -m benchmarks.sim speed     beside a plain program and the bare transfers
    python -m benchmarks.sim start     CPU seconds until the second frame, cold, warm
    python -m benchmarks.sim seeds     seconds of each seed with rendering and encoding
    python -m benchmarks.sim scaling   two processes against one

Rivals take turns within a run, since machines are shared: trust the ratios.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import IO

from benchmarks.physics.world import body, box, matter, world
from benchmarks.sim.rivals import children, plain

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.program.link import link
from mpmworlds.sim.run.encode import encode_mp4
from mpmworlds.sim.run.run import run
from mpmworlds.sim.scene.scene import Scene

HERE = Path(__file__).parent
ROUNDS = 9
BLOCKS = {
    "liquid": {"density": 1000.0, "bulk_modulus": 4e5, "viscosity": 0.1},
    "elastic": {"density": 1000.0, "youngs_modulus": 4e5, "poissons_ratio": 0.3},
    "snow": {"density": 400.0, "youngs_modulus": 6e4, "poissons_ratio": 0.2},
    "sand": {"density": 1600.0, "youngs_modulus": 8e5, "poissons_ratio": 0.25},
}


def block(material: str) -> Scene:
    """A block of 10,000 particles that falls a little, at 128 cells and 0.1 ms."""
    falling = body(
        box((0.4953, 0.2453), 0.390625, 0.390625), matter(material, **BLOCKS[material])
    )
    return world(falling, cells=128, seconds=3.0, walls="slip", substeps=100)


class Rival:
    """A process that runs substeps on demand."""

    def __init__(self, *command: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, *command],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | {"TI_SKIP_VERSION_CHECK": "ON"},
        )
        while self._output().readline().strip() != "ready":
            if self.process.poll() is not None:
                raise SystemExit(f"{' '.join(command)} ended before it was ready")

    def _output(self) -> IO[str]:
        assert self.process.stdout is not None
        return self.process.stdout

    def ask(self, substeps: int) -> None:
        """Start a number of substeps."""
        assert self.process.stdin is not None
        self.process.stdin.write(f"{substeps}\n")
        self.process.stdin.flush()

    def answer(self) -> float:
        """Seconds [s] that they took."""
        return float(self._output().readline())

    def close(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.wait()


def speed(materials: Sequence[str]) -> None:
    """Print speeds and ratios for blocks of each material."""
    names = "material", "ours [M/s]", "plain, 1 thread", "2 threads", "bare transfers"
    print(f"| {' | '.join(names)} | ours / plain | ours / bare |")
    print("|---|---|---|---|---|---|---|")
    for material in materials:
        with tempfile.TemporaryDirectory() as folder:
            program, rival = Path(folder, "program.py"), Path(folder, "plain.py")
            program.write_text(link(block(material)), "ascii")
            rival.write_text(plain(material), "utf-8")
            rivals = [Rival(str(HERE / "ours.py"), str(program))]
            rivals += [Rival(str(rival), threads) for threads in ("1", "2")]
            rivals += [Rival(str(HERE / "ours.py"), str(HERE / "bare.py"))]
        rates: list[list[float]] = [[], [], [], []]
        for _ in range(ROUNDS):
            for k, rival in enumerate(rivals):
                rival.ask(100)
                rates[k].append(1e4 * 100 / rival.answer() / 1e6)
        to_plain, to_bare = (
            statistics.median(a / b for a, b in zip(rates[0], rates[k], strict=True))
            for k in (1, 3)
        )
        speeds = " | ".join(f"{statistics.median(rate):.1f}" for rate in rates)
        print(f"| {material} | {speeds} | {to_plain:.1f} | {to_bare:.2f} |", flush=True)
        for rival in rivals:
            rival.close()


def chosen(names: Sequence[str]) -> dict[str, Scene]:
    """Seeds whose names begin with one of those given; all if none is given."""
    start = tuple(names) or ("",)
    return {k: scene for k, scene in load_seeds().items() if k.startswith(start)}


def start(names: Sequence[str]) -> None:
    """Print CPU seconds from a program's start to its second frame, cold and warm."""
    print("| seed | cold cache [s] | warm cache [s] | of which start of Taichi [s] |")
    print("|---|---|---|---|")
    bare = _seconds("import cv2, taichi as ti; ti.init(arch=ti.cpu)", {})
    for name, scene in chosen(names).items():
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "program.py").write_text(link(scene), "ascii")
            code = (
                f"import sys; sys.path.insert(0, {folder!r}); import program;"
                "frames = program.frames(); next(frames); next(frames)"
            )
            cache = {"TI_OFFLINE_CACHE_FILE_PATH": str(Path(folder, "cache"))}
            cold, warm = (_seconds(code, cache) for _ in range(2))
        print(f"| {name} | {cold:.1f} | {warm:.1f} | {bare:.1f} |")


def _seconds(code: str, environment: dict[str, str]) -> float:
    """CPU seconds of a Python process."""
    before = children()
    subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"TI_SKIP_VERSION_CHECK": "ON"} | environment,
        capture_output=True,
        check=True,
    )
    return children() - before


def seeds(names: Sequence[str]) -> None:
    """Print wall seconds of seeds: simulation and rendering, then encoding."""
    print("| seed | substeps | simulate and render [s] | encode [s] |")
    print("|---|---|---|---|")
    for name, scene in chosen(names).items():
        begin = time.perf_counter()
        outcome = run(link(scene), timeout=3600.0, trusted=True)
        ran = time.perf_counter()
        encode_mp4(outcome.frames, scene.output.framerate)
        done = time.perf_counter()
        steps = scene.simulation.substeps_per_frame * scene.simulation.duration_frames
        print(
            f"| {name} | {steps} | {ran - begin:.1f} | {done - ran:.1f} |", flush=True
        )


def scaling() -> None:
    """Print how much more two processes do than one."""
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder, "program.py")
        program.write_text(link(block("liquid")), "ascii")
        pair = [Rival(str(HERE / "ours.py"), str(program)) for _ in range(2)]
    gains = []
    for _ in range(ROUNDS):
        pair[0].ask(300)
        alone = pair[0].answer()
        for rival in pair:
            rival.ask(300)
        together = [rival.answer() for rival in pair]
        gains.append(sum(alone / seconds for seconds in together))
    print(f"two processes do {statistics.median(gains):.2f} times the work of one")
    for rival in pair:
        rival.close()


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=["speed", "start", "seeds", "scaling"])
    parser.add_argument(
        "names", nargs="*", help="materials, or seeds (s09 ...); all by default"
    )
    given = parser.parse_args()
    if given.what == "speed":
        speed(given.names or list(BLOCKS))
    elif given.what == "scaling":
        scaling()
    else:
        {"start": start, "seeds": seeds}[given.what](given.names)


if __name__ == "__main__":
    main()
