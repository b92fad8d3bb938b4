"""How much memory a video model takes, by formula: what is kept, and the highest peak.

Weights are counted exactly. What is computed is estimated from the shapes of the Wan
transformer and its encoder of videos; runs on a GPU should be within a third of it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

STRIDE: Final = 4  # frames to a latent, after the first
SPACE: Final = 8  # pixels to a latent, along each side
PATCH: Final = 2  # latents to a token, along each side
FULL: Final = 4  # bytes of a float32, in which videos are encoded
HALF: Final = 2  # bytes of a bfloat16
# Feature maps of the encoder of videos that are alive at once, at full resolution, for
# four frames: two of a residual block, its input, and what its convolutions keep of the
# frames before, in channels of `base_dim` twice.
LIVE_MAPS: Final = 6
# Tensors of the width of the model that a block keeps for its gradient: three norms,
# query, key and value of two attentions, their outputs, projections and sums.
KEPT_IN_BLOCK: Final = 16


@dataclass(frozen=True)
class Clip:
    """The form of one call."""

    frames: int
    height: int
    width: int

    @property
    def tokens(self) -> int:
        """What a clip is to the transformer."""
        latents = (self.frames - 1) // STRIDE + 1
        return (
            latents * (self.height // SPACE // PATCH) * (self.width // SPACE // PATCH)
        )


def weight_bytes(parameters: Mapping[str, int], bytes_each: int) -> int:
    """Bytes of weights; those of the encoder of videos have four each."""
    return sum(
        count * (FULL if part == "vae" else bytes_each)
        for part, count in parameters.items()
    )


def inference_bytes(
    parameters: Mapping[str, int],
    transformer: Mapping[str, Any],
    vae: Mapping[str, Any],
    clip: Clip,
    bytes_each: int = HALF,
) -> int:
    """Memory of a call [bytes].

    Parameters
    ----------
    parameters
        Of `weights.parameters_of`.
    transformer, vae
        Their configurations.
    clip
        Form of the call.
    bytes_each
        Of a weight.
    """
    width = _width(transformer)
    hints = len(transformer["vace_layers"])  # one is kept for each control block
    block = (8 * width + 2 * transformer["ffn_dim"]) * FULL
    denoising: int = clip.tokens * (hints * width * bytes_each + block)
    return weight_bytes(parameters, bytes_each) + max(denoising, _coding(vae, clip))


def training_bytes(
    parameters: Mapping[str, int],
    transformer: Mapping[str, Any],
    vae: Mapping[str, Any],
    clip: Clip,
    rank: int,
    *,
    checkpointing: bool,
    bytes_each: int = HALF,
) -> int:
    """Memory of a step of LoRA training [bytes]; see `inference_bytes`.

    A weight of LoRA takes 16 bytes: itself, its gradient, and two moments.
    """
    width = _width(transformer)
    blocks = transformer["num_layers"] + len(transformer["vace_layers"])
    inside = KEPT_IN_BLOCK * width + 2 * transformer["ffn_dim"]
    kept = blocks * width + inside if checkpointing else blocks * (width + inside)
    step: int = clip.tokens * kept * max(bytes_each, HALF)
    lora = 4 * FULL * lora_parameters(transformer, rank)
    return weight_bytes(parameters, bytes_each) + lora + max(step, _coding(vae, clip))


def lora_parameters(transformer: Mapping[str, Any], rank: int) -> int:
    """Weights of a LoRA on both attentions and the two layers behind them."""
    width, inner = _width(transformer), int(transformer["ffn_dim"])
    blocks = int(transformer["num_layers"]) + len(transformer["vace_layers"])
    return blocks * rank * (8 * 2 * width + 2 * (width + inner))


def _width(transformer: Mapping[str, Any]) -> int:
    return int(transformer["num_attention_heads"] * transformer["attention_head_dim"])


def _coding(vae: Mapping[str, Any], clip: Clip) -> int:
    """Four frames pass through the encoder of videos at a time."""
    maps = LIVE_MAPS * 2 * vae["base_dim"] * STRIDE
    pixels = clip.height * clip.width
    return int(pixels * (maps + 3 * clip.frames) * FULL)
