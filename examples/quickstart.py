"""Load a sample of a built release, look at it, and score a predictor.

Run it in the folder that holds `release/mpmworlds`:

    mpmworlds build --config tiny --out release/mpmworlds
    python examples/quickstart.py
"""

from pathlib import Path

from datasets import load_dataset

import mpmworlds
from mpmworlds.baselines.evaluate import evaluate

RELEASE = Path("release/mpmworlds")


def main() -> None:
    """Print a sample and the evaluation table, and write the sample's video."""
    sample = load_dataset("mpmworlds", "tiny", split="test")[0]
    for name, value in sample.items():
        is_video = name in ("video", "clip")
        text = f"MP4, {len(value['bytes'])} bytes" if is_video else str(value)
        print(f"{name:>16}  {' '.join(text.split())[:96]}")

    example = mpmworlds.load("tiny", split="test")[0]
    print(
        f"\nprefix {example.prefix.shape}, continuation {example.continuation.shape}\n"
    )

    out = evaluate(RELEASE, "copy_last", "test", Path("work/results/copy_last"))
    print((out.parent / "summary.txt").read_text())

    video = Path("work/quickstart.mp4")
    video.write_bytes(sample["video"]["bytes"])
    print(f"video of {sample['id']}: {video}")


if __name__ == "__main__":
    main()
