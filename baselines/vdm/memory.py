"""How much memory a video model takes, by formula: what is kept, and the highest peak.

Weights are counted, and so is what the backward pass needs (by the hooks of autograd,
which a test repeats); what a call takes on the way is estimated from shapes.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from mpmworlds.baselines.vdm.text import MOST_TOKENS

STRIDE: Final = 4  # frames to a latent, after the first
SPACE: Final = 8  # pixels to a latent, along each side
PATCH: Final = 2  # latents to a token, along each side
FULL: Final = 4  # bytes of a float32, in which videos are encoded
HALF: Final = 2  # bytes of a bfloat16
# Feature maps of the encoder of videos that are alive at once, at full resolution, for
# four frames: two of a residual block, its input, and what its convolutions keep of the
# frames before, in channels of `base_dim` twice.
LIVE_MAPS: Final = 6
# Bytes that a block of a bfloat16 model with a float32 LoRA keeps for its gradient.
KEPT_OF_WIDTH: Final = 63  # for each token and channel of the model
KEPT_OF_INNER: Final = 6  # for each token and channel of the layers behind
KEPT_OF_RANK: Final = 45  # for each token and rank of the LoRA
KEPT_OF_TEXT: Final = 17  # for each token of the text and channel of the model


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


def on_device(parameters: Mapping[str, int], text_device: str) -> Mapping[str, int]:
    """Parameters of the parts that are on the GPU."""
    elsewhere = {"text_encoder"} if text_device == "cpu" else set()
    return {part: n for part, n in parameters.items() if part not in elsewhere}


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
    blocks = transformer["num_layers"] + len(transformer["vace_layers"])
    inside = kept_in_block(transformer, clip, rank, bytes_each)
    step: int = blocks * inside
    if checkpointing:  # only what goes into a block, and one block at a time
        step = blocks * clip.tokens * _width(transformer) * bytes_each + inside
    lora = 4 * FULL * lora_parameters(transformer, rank)
    return weight_bytes(parameters, bytes_each) + lora + max(step, _coding(vae, clip))


def kept_in_block(
    transformer: Mapping[str, Any], clip: Clip, rank: int, bytes_each: int = HALF
) -> int:
    """What one block keeps for its gradient [bytes]; in float32 twice as much."""
    width = _width(transformer)
    of_token = (
        KEPT_OF_WIDTH * width
        + KEPT_OF_INNER * int(transformer["ffn_dim"])
        + KEPT_OF_RANK * rank
    )
    kept = clip.tokens * of_token + MOST_TOKENS * KEPT_OF_TEXT * width
    return kept * bytes_each // HALF


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
