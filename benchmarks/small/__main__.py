"""Measure the label model, and draw the curve of a training.

python -m benchmarks.small speed [--recipe cpu] [--threads 2] [--device auto]
python -m benchmarks.small curve --training work/models/small --out curve.png
"""

import argparse
import json
import statistics
import time
from pathlib import Path

import numpy as np
import torch

from mpmworlds.baselines.learned.devices import device_named
from mpmworlds.baselines.small.learning.losses import unrolled
from mpmworlds.baselines.small.network import LabelUNet, Shape
from mpmworlds.baselines.small.rollout import continued
from mpmworlds.baselines.small.settings import TrainingSettings

SIDE, SEEN, CONTINUED = 256, 38, 112
ROUNDS = 3


def main() -> None:
    """Measure or draw what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("what", choices=("speed", "curve"))
    parser.add_argument("--recipe", default="cpu")
    parser.add_argument("--threads", type=int, default=torch.get_num_threads())
    parser.add_argument("--device", default="auto")
    parser.add_argument("--training", type=Path, default=Path("work/models/small"))
    parser.add_argument("--out", type=Path, default=Path("curve.png"))
    given = parser.parse_args()
    if given.what == "speed":
        torch.set_num_threads(given.threads)
        print(speed(given.recipe, given.device))
    else:
        curve(given.training, given.out)


def speed(recipe: str, device_name: str) -> str:
    """Windows a second in training, and seconds of a sample when it is continued."""
    settings = TrainingSettings.read(recipe)
    device = device_named(device_name)
    network = LabelUNet(Shape.of(settings, told=False)).to(device)
    optimizer = torch.optim.AdamW(network.parameters())
    frames = settings.context + settings.horizon
    size = settings.batch, frames, SIDE, SIDE
    labels = torch.randint(0, 4, size, generator=torch.Generator().manual_seed(0))
    labels = labels.to(device)

    def step() -> None:
        optimizer.zero_grad()
        for loss, _, _ in unrolled(network, labels, None, settings.context, 4.0):
            loss.backward()
        optimizer.step()
        _wait(device)

    begun = labels[0, :1].expand(SEEN, -1, -1).cpu().numpy().astype(np.uint8)

    def sample() -> None:
        continued(network.eval(), begun, CONTINUED)
        _wait(device)

    step()
    seconds = [_seconds(step) for _ in range(ROUNDS)]
    whole = _seconds(sample)
    count = sum(p.numel() for p in network.parameters()) / 1e6
    return (
        f"{recipe} on {device}, {torch.get_num_threads()} threads: {count:.1f} M "
        f"parameters, {settings.batch / statistics.median(seconds):.2f} windows of "
        f"{frames} frames a second in training, {whole:.1f} s for the {CONTINUED} "
        "frames of a sample"
    )


def _wait(device: torch.device) -> None:
    if device.type == "cuda":
        torch.cuda.synchronize(device)


def _seconds(work) -> float:  # noqa: ANN001 - any function
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def curve(training: Path, out: Path) -> None:
    """Draw the loss, and the share of changed pixels that are right, over steps."""
    from matplotlib.figure import Figure

    lines = [json.loads(line) for line in (training / "log.jsonl").open("rb")]
    figure = Figure(figsize=(8, 3), layout="constrained")
    left, right = figure.subplots(1, 2)
    for axes, name, what in (
        (left, "loss", "cross-entropy"),
        (right, "moved", "changed pixels that are right"),
    ):
        steps = [line["step"] for line in lines if name in line]
        axes.plot(steps, [line[name] for line in lines if name in line], lw=0.7)
        key = f"held_out_{name}"
        steps = [line["step"] for line in lines if key in line]
        axes.plot(steps, [line[key] for line in lines if key in line], marker=".")
        axes.set(xlabel="steps", ylabel=what)
        axes.spines[["top", "right"]].set_visible(False)
    left.set_yscale("log")
    right.set_ylim(0, 1)
    right.legend(["training", "held out"], frameon=False)
    figure.savefig(out, dpi=150)
    print(out)


if __name__ == "__main__":
    main()
