"""What Qwen2.5-VL takes: parameters, memory of writing and of training.

Counted from the shapes of the layers. Parameters are exact; what activations take is an
estimate, for attention that keeps no matrix of scores.
"""

from dataclasses import dataclass
from typing import Any, Final, Self

BYTES: Final = {"float32": 4, "bfloat16": 2, "float16": 2}
"""Of a number, by the name of its type."""
STATE_BYTES: Final = 16
"""Of a parameter in mixed precision with AdamW: itself, its gradient, two moments."""
LOGIT_BYTES: Final = 14
"""Of a logit in training: itself, its logarithm, and the gradients of both."""
CHUNK: Final = 1024
"""Tokens whose logits are there at once in training, see `chunk_loss`."""


@dataclass(frozen=True)
class Shape:
    """The numbers of a model of the family."""

    hidden: int
    inner: int
    layers: int
    heads: int
    key_heads: int
    vocabulary: int
    tied: bool
    """Whether words are read and written by the same matrix."""
    eye_hidden: int
    """Of the vision tower, as all that follow."""
    eye_inner: int
    eye_layers: int
    patch: int
    frames: int
    """That a patch spans."""
    merge: int
    """Patches per side that become a token."""

    @classmethod
    def of(cls, config: Any) -> Self:
        """Of a `Qwen2_5_VLConfig`."""
        text, eye = config.text_config, config.vision_config
        return cls(
            hidden=text.hidden_size,
            inner=text.intermediate_size,
            layers=text.num_hidden_layers,
            heads=text.num_attention_heads,
            key_heads=text.num_key_value_heads,
            vocabulary=text.vocab_size,
            tied=bool(config.tie_word_embeddings),
            eye_hidden=eye.hidden_size,
            eye_inner=eye.intermediate_size,
            eye_layers=eye.depth,
            patch=eye.patch_size,
            frames=eye.temporal_patch_size,
            merge=eye.spatial_merge_size,
        )

    @property
    def keys(self) -> int:
        """Width of the keys, and of the values, of a layer."""
        return self.key_heads * (self.hidden // self.heads)

    @property
    def layer(self) -> int:
        """Parameters of a layer of the language model."""
        attention = 2 * self.hidden**2 + self.hidden + 2 * (self.hidden + 1) * self.keys
        return attention + 3 * self.hidden * self.inner + 2 * self.hidden

    @property
    def words(self) -> int:
        """Parameters that read and write words."""
        return (1 if self.tied else 2) * self.vocabulary * self.hidden

    @property
    def eye(self) -> int:
        """Parameters of the vision tower."""
        d, inner = self.eye_hidden, self.eye_inner
        block = 4 * d**2 + 4 * d + 3 * d * inner + 2 * inner + d + 2 * d
        wide = d * self.merge**2
        merger = d + wide**2 + wide + wide * self.hidden + self.hidden
        return 3 * self.frames * self.patch**2 * d + self.eye_layers * block + merger

    @property
    def parameters(self) -> int:
        """All parameters."""
        return self.words + self.layers * self.layer + self.hidden + self.eye


QWEN_7B: Final = Shape(
    hidden=3584,
    inner=18944,
    layers=28,
    heads=28,
    key_heads=4,
    vocabulary=152064,
    tied=False,
    eye_hidden=1280,
    eye_inner=3420,
    eye_layers=32,
    patch=14,
    frames=2,
    merge=2,
)
"""Of Qwen2.5-VL-7B-Instruct: 8,292,166,656 parameters."""


def writing_bytes(
    shape: Shape, dtype: str, sequences: int, prompt: int, new: int
) -> int:
    """Memory of writing replies [bytes].

    Parameters
    ----------
    shape
        Of the model.
    dtype
        A key of `BYTES`.
    sequences
        Replies that are written at once; each holds the prompt for itself.
    prompt, new
        Tokens of the prompt, and of a reply at most.
    """
    size = BYTES[dtype]
    weights = shape.parameters * size
    cache = sequences * (prompt + new) * 2 * shape.layers * shape.keys * size
    reading = sequences * prompt * (2 * shape.inner + 4 * shape.hidden) * size
    choosing = sequences * shape.vocabulary * 4 * 4  # sorted for top-p, in float32
    return weights + cache + reading + choosing


def training_bytes(shape: Shape, shards: int, tokens: int, *, half: bool = True) -> int:
    """Memory of full finetuning, on each device, with checkpoints of layers [bytes].

    Parameters
    ----------
    shape
        Of the model.
    shards
        Devices that share parameters, gradients and moments.
    tokens
        Of the examples of a device, prompts and answers.
    half
        Whether layers are computed in bfloat16.
    """
    size = 2 if half else 4
    state = STATE_BYTES * shape.parameters // shards
    # Words stay gathered for a whole step, with their gradients; of layers, the one
    # that is computed and the one that comes next.
    gathered = 2 * (shape.words + 2 * shape.layer) * size if shards > 1 else 0
    kept = shape.layers * tokens * shape.hidden * size
    computed = 2 * tokens * (3 * shape.inner + 8 * shape.hidden) * size
    logits = LOGIT_BYTES * min(tokens, CHUNK) * shape.vocabulary
    return state + gathered + kept + computed + logits
