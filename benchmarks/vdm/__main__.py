"""Tokens of the texts of a corpus, and memory of models, for `benchmarks/vdm.md`.

    python -m benchmarks.vdm texts --tokenizer FOLDER [--every 401]
    python -m benchmarks.vdm memory

The first needs the tokenizer of a checkpoint, as `from_pretrained` takes it: a folder,
or `Wan-AI/Wan2.1-VACE-1.3B-diffusers` with `--subfolder tokenizer`. The second counts
by formula what published models take.
"""

import argparse
import statistics
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from benchmarks.vdm.models import VAE, models
from transformers import AutoTokenizer

from mpmworlds.baselines.learned.devices import GIB
from mpmworlds.baselines.vdm.backends.wan_pipeline import parameters_of
from mpmworlds.baselines.vdm.memory import (
    Clip,
    inference_bytes,
    lora_parameters,
    training_bytes,
)
from mpmworlds.baselines.vdm.text import MOST_TOKENS, text_for
from mpmworlds.builder.plan.manifest import read_manifest, recorded_manifest
from mpmworlds.loaders.regimes import REGIMES
from mpmworlds.sim.scene.scene import Scene

CLIPS = {
    "256 px, 81 frames": Clip(81, 256, 256),
    "480 px, 81 frames": Clip(81, 480, 480),
}
RANK = 32


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["texts", "memory"])
    parser.add_argument("--tokenizer")
    parser.add_argument("--subfolder", default="")
    parser.add_argument("--every", type=int, default=401)
    options = parser.parse_args()
    if options.what == "memory":
        memory()
    else:
        place = options.tokenizer
        tokenizer = AutoTokenizer.from_pretrained(place, subfolder=options.subfolder)
        texts(lambda text: len(tokenizer(text).input_ids), options.every)


def texts(count: Callable[[str], int], every: int) -> None:
    """Print tokens of what regimes tell, as it is and as a video model is told it."""
    rows = read_manifest(recorded_manifest("full"))[::every]
    scenes = [Scene.from_yaml(row.scene, row.id) for row in rows]
    print(f"{len(scenes)} scenes, every {every}th; a model reads {MOST_TOKENS} tokens")
    print(f"{'regime':14} {'as':8} {'median':>7} {'95 %':>6} {'most':>6} {'cut':>7}")
    for regime in REGIMES.values():
        told = [regime.tell(scene) for scene in scenes]
        print(f"{regime.name:14} {'told':8} {_spread([count(text) for text in told])}")
        shorter = [count(text_for(text)) for text in told]
        print(f"{'':14} {'text_for':8} {_spread(shorter)}")


def _spread(tokens: Sequence[int]) -> str:
    last = statistics.quantiles(tokens, n=20)[-1]
    cut = sum(n > MOST_TOKENS for n in tokens) / len(tokens)
    return f"{statistics.median(tokens):7.0f} {last:6.0f} {max(tokens):6} {cut:7.1%}"


def memory() -> None:
    """Print parameters and memory of models."""
    for name, configs in models().items():
        parts = parameters_of(configs)
        lora = lora_parameters(configs["transformer"], RANK)
        counts = ", ".join(f"{part} {n / 1e9:.2f}" for part, n in parts.items())
        print(
            f"{name}: {counts} billion; LoRA of rank {RANK}: {lora / 1e6:.0f} million"
        )
        transformer = configs["transformer"]
        for form, clip in CLIPS.items():
            used = inference_bytes(parts, transformer, VAE, clip) / GIB
            steps = [
                training_bytes(parts, transformer, VAE, clip, RANK, checkpointing=again)
                for again in (True, False)
            ]
            again, kept = (step / GIB for step in steps)
            call = 2 * parts["transformer"] * clip.tokens + attention(transformer, clip)
            print(
                f"  {form}: {clip.tokens} tokens, call {used:.0f} GiB, training "
                f"{again:.0f} GiB with checkpointing, {kept:.0f} GiB without; "
                f"{call / 1e12:.0f} TFLOP forward"
            )


def attention(transformer: Mapping[str, Any], clip: Clip) -> int:
    """Operations of the products between tokens, which no parameter counts."""
    width = transformer["num_attention_heads"] * transformer["attention_head_dim"]
    blocks = transformer["num_layers"] + len(transformer["vace_layers"])
    return int(4 * blocks * width * clip.tokens * (clip.tokens + MOST_TOKENS))


if __name__ == "__main__":
    main()
