"""Tokens of programs, scenes and prompts, as Qwen2.5 counts them."""

import statistics
import sys
from collections.abc import Callable, Iterator
from importlib.resources import files

import numpy as np
import pyarrow.parquet as pq
from benchmarks.link import STRIDE, counter, row_of

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.loaders.clips import Clip, sampled
from mpmworlds.loaders.prompts import PICTURES, VideoForm, answer_of, make_prompt
from mpmworlds.loaders.regimes import REGIMES
from mpmworlds.metrics.reduction import FRAMERATE, SIDE, prefix_length
from mpmworlds.sim.program.link import link
from mpmworlds.sim.scene.scene import Scene

PICTURE = 81 + 2  # tokens of 256 x 256 pixels, and of where they begin and end
TURNS = 15  # tokens that begin and end the three turns of a chat
MANIFEST = files("mpmworlds.builder") / "recorded" / "full.parquet"


def tokens() -> None:
    """Print how many tokens answers and prompts take."""
    count = counter()
    if count is None:
        sys.exit("pip install tiktoken and dashscope, which has Qwen's vocabulary")
    found = list(scenes())
    print(f"{len(found)} scenes: the seeds, and every {STRIDE}st row of the corpus\n")
    print("| tokens | median | mean | 95 % | largest |\n|---|---:|---:|---:|---:|")
    for task, text in (("program", link), ("scene", Scene.to_yaml)):
        answers = [answer_of({task: text(scene)}, task) for scene in found]
        print(line(f"answer, {task}", [count(answer) for answer in answers]))
    for regime in REGIMES:
        sizes = [prompt_tokens(scene, regime, count) for scene in found]
        print(line(f"prompt, {regime}", sizes))
    wholes = [
        prompt_tokens(scene, "full_config", count)
        + count(answer_of({"program": link(scene)}, "program"))
        for scene in found
    ]
    print(line("both, full_config", wholes))


def scenes() -> Iterator[Scene]:
    """The seeds, and some rows of the corpus."""
    yield from load_seeds().values()
    with MANIFEST.open("rb") as file:
        texts = pq.read_table(file, columns=["scene"])["scene"].to_pylist()
    yield from map(row_of, texts[::STRIDE])


def prompt_tokens(scene: Scene, regime: str, count: Callable[[str], int]) -> int:
    """Tokens of a prompt for a program, its pictures among them."""
    blank = np.zeros((prefix_length(FRAMERATE), SIDE, SIDE, 3), np.uint8)
    output = scene.output
    form = VideoForm(
        scene.simulation.duration_frames, output.framerate, output.resolution
    )
    told = REGIMES[regime].tell(scene)
    stills = sampled(Clip(blank, FRAMERATE), PICTURES)
    prompt = make_prompt(stills, REGIMES[regime], told, form)
    texts = [prompt.system, *(part for part in prompt.user if isinstance(part, str))]
    return sum(count(f"{text}\n") for text in texts) + PICTURES * PICTURE + TURNS


def line(name: str, values: list[int]) -> str:
    """A row of the table."""
    middle, mean = statistics.median(values), statistics.fmean(values)
    high = float(np.quantile(values, 0.95))
    return f"| {name} | {middle:,.0f} | {mean:,.0f} | {high:,.0f} | {max(values):,} |"
