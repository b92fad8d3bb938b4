"""Shapes of published models, by their authors [Wan Team 2025; Jiang et al. 2025]."""

from typing import Any, Final

VAE: Final[dict[str, Any]] = {
    "base_dim": 96,
    "z_dim": 16,
    "dim_mult": [1, 2, 4, 4],
    "num_res_blocks": 2,
    "temperal_downsample": [False, True, True],
}
TEXT_ENCODER: Final[dict[str, Any]] = {  # that of UMT5-XXL
    "vocab_size": 256384,
    "d_model": 4096,
    "d_kv": 64,
    "d_ff": 10240,
    "num_layers": 24,
    "num_heads": 64,
    "feed_forward_proj": "gated-gelu",
}


def models() -> dict[str, dict[str, dict[str, Any]]]:
    """Configurations of the parts of each model."""
    return {
        "Wan2.1-VACE-1.3B": _parts(12, 8960, 30, 2),
        "Wan2.1-VACE-14B": _parts(40, 13824, 40, 5),
    }


def _parts(heads: int, ffn: int, layers: int, every: int) -> dict[str, dict[str, Any]]:
    transformer: dict[str, Any] = {
        "num_attention_heads": heads,
        "attention_head_dim": 128,
        "in_channels": 16,
        "out_channels": 16,
        "text_dim": 4096,
        "freq_dim": 256,
        "ffn_dim": ffn,
        "num_layers": layers,
        "vace_layers": list(range(0, layers, every)),
        "vace_in_channels": 96,
    }
    return {"transformer": transformer, "vae": VAE, "text_encoder": TEXT_ENCODER}
