"""Memory of the 7B model, by the formulas of `mpmworlds.baselines.vlm.memory`."""

from mpmworlds.baselines.vlm.memory import QWEN_7B, training_bytes, writing_bytes

GB = 1e9
SAMPLES, EPOCHS, TOKENS = 10_000, 2, 6_213  # of `10k`; mean tokens, see `tokens`
PATCHES = 8 * 324  # of eight pictures
RATES = (60e12, 125e12)  # sustained by a GPU [FLOP/s]
PROMPT, NEW = 3500, 8192
SEQUENCE = (6144, 10240)


def memory() -> None:
    """Print estimates of writing and of finetuning [GB], and hours of the latter."""
    count = QWEN_7B.parameters
    print(f"{count:,} parameters, {2 * count / GB:.1f} GB in bfloat16\n")
    print("| replies at once | bfloat16 [GB] | float32 [GB] |\n|---:|---:|---:|")
    for sequences in (1, 3, 5, 15):
        sizes = [
            writing_bytes(QWEN_7B, dtype, sequences, PROMPT, NEW) / GB
            for dtype in ("bfloat16", "float32")
        ]
        print(f"| {sequences} | {sizes[0]:.1f} | {sizes[1]:.1f} |")
    head = " | ".join(f"{size:,} tokens [GB]" for size in SEQUENCE)
    print(f"\n| GPUs | {head} |\n|---:|---:|---:|")
    for gpus in (1, 2, 4, 8):
        sizes = [training_bytes(QWEN_7B, gpus, size) / GB for size in SEQUENCE]
        print(f"| {gpus} | {sizes[0]:.1f} | {sizes[1]:.1f} |")
    hours = [flops() / (4 * rate) / 3600 for rate in RATES]
    print(
        f"\n{flops():.1e} FLOP of finetuning: {hours[1]:.1f} to {hours[0]:.1f} h on 4"
    )


def flops() -> float:
    """Of a finetuning: forward, again for the checkpoints, and twice as much back."""
    language = (QWEN_7B.parameters - QWEN_7B.eye) * TOKENS
    return 8.0 * SAMPLES * EPOCHS * (language + QWEN_7B.eye * PATCHES)
