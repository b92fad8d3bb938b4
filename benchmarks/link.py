"""Time the linker over seeds and rows: `python benchmarks/link.py [MANIFEST]`.

With a manifest, every 401st of its rows is linked, too. Tokens are those of Qwen
models, if `tiktoken` and `dashscope`, which ships their vocabulary, are installed.
"""

import base64
import statistics
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import pyarrow.parquet as pq

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.program.link import link
from mpmworlds.sim.scene.scene import Scene
from mpmworlds.sim.scene.text import parse_yaml

ROUNDS, STRIDE = 5, 401
WORDS = (
    r"(?i:'s|'t|'re|'ve|'m|'ll|'d)|[^\r\n\p{L}\p{N}]?\p{L}+|\p{N}"
    r"| ?[^\s\p{L}\p{N}]+[\r\n]*|\s*[\r\n]+|\s+(?!\S)|\s+"
)


def counter() -> Callable[[str], int] | None:
    """Function text -> number of tokens; None if that cannot be told."""
    spec = find_spec("dashscope")
    if not (spec and spec.submodule_search_locations and find_spec("tiktoken")):
        return None
    import tiktoken

    home = Path(spec.submodule_search_locations[0])
    (path,) = home.rglob("qwen.tiktoken")
    pairs = (line.split() for line in path.read_bytes().splitlines() if line)
    ranks = {base64.b64decode(token): int(rank) for token, rank in pairs}
    coding = tiktoken.Encoding(
        "qwen", pat_str=WORDS, mergeable_ranks=ranks, special_tokens={}
    )
    return lambda text: len(coding.encode_ordinary(text))


def main() -> None:
    """Print time, lines and tokens of each seed, and the medians and largest of all."""
    count, found, every = counter(), [], []
    for name, scene in load_seeds().items():
        link(scene)  # reads and parses the library once
        times = []
        for _ in range(ROUNDS):
            start = time.process_time()
            program = link(scene)
            times.append(1e3 * (time.process_time() - start))
        every += times
        found.append(size_of(program, count))
        lines, tokens = found[-1]
        took = statistics.median(times)
        print(f"{name:>22}  {took:6.1f} ms  {lines} lines  {tokens} tokens")
    for path in sys.argv[1:]:
        texts = pq.read_table(path, columns=["scene"])["scene"].to_pylist()[::STRIDE]
        for text in texts:
            found.append(size_of(link(row_of(text)), count))
    print(f"median {statistics.median(every):.1f} ms; {len(found)} programs")
    for what, values in zip(("lines", "tokens"), zip(*found, strict=True), strict=True):
        print(f"{what}: median {statistics.median(values)}, largest {max(values)}")


def size_of(program: str, count: Callable[[str], int] | None) -> tuple[int, int]:
    """Lines and tokens of a program, 0 if tokens cannot be told."""
    return program.count("\n"), count(program) if count else 0


def row_of(text: str) -> Scene:
    """A scene whose rules were checked when it was planned."""
    data = parse_yaml(text, "row")
    return Scene.model_validate(data | {"objects": tuple(data["objects"])})


if __name__ == "__main__":
    main()
