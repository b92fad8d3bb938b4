"""The adapter of LongCat-Video, against a stand-in that is called in the same way.

The signatures are those of the authors' code; nothing is said of the real weights.
"""

import shutil
import sys

import numpy as np
import pytest
import torch

from mpmworlds.baselines.vdm.predictor import Vdm
from tests.baselines.vdm.tiny import task_of

LOADED = """
class {name}:
    @classmethod
    def from_pretrained(cls, folder, subfolder, torch_dtype, **more):
        made = cls()
        made.told = (subfolder, str(torch_dtype), more)
        return made

    def load_lora(self, path, key, multiplier=1.0, lora_network_dim=128,
                  lora_network_alpha=64):
        self.lora = path, key

    def enable_loras(self, lora_key_list=[]):
        self.enabled = lora_key_list
"""
PIPELINE = """
import numpy as np
import torch

CALLS = []


class LongCatVideoPipeline:
    def __init__(self, tokenizer, text_encoder, vae, scheduler, dit):
        self.tokenizer, self.dit = tokenizer, dit
        CALLS.append(("made", dit.told, getattr(dit, "lora", None)))

    def to(self, device):
        return self

    def generate_vc(self, video, prompt=None, negative_prompt=None, resolution="480p",
                    num_frames=93, num_cond_frames=13, num_inference_steps=50,
                    use_distill=False, guidance_scale=4.0, num_videos_per_prompt=1,
                    generator=None, latents=None, output_type="np",
                    attention_kwargs=None, max_sequence_length=512, use_kv_cache=True,
                    offload_kv_cache=False, enhance_hf=True):
        assert resolution in ("480p", "720p") and num_frames % 4 == 1
        known = np.stack([np.asarray(frame.resize((160, 160))) for frame in video])
        noise = torch.rand(1, generator=generator).item()
        CALLS.append(("called", len(video), num_frames, num_cond_frames, prompt))
        frames = np.full((num_frames, 160, 160, 3), noise, np.float32)
        frames[:num_cond_frames] = 0.5  # what is given comes back changed
        return frames[None]
"""
SPLIT = """
def get_cp_size():
    return 1


def get_optimal_split(size):
    return [1, size]
"""
MODULES = {
    "modules/autoencoder_kl_wan.py": LOADED.format(name="AutoencoderKLWan"),
    "modules/scheduling_flow_match_euler_discrete.py": LOADED.format(
        name="FlowMatchEulerDiscreteScheduler"
    ),
    "modules/longcat_video_dit.py": LOADED.format(
        name="LongCatVideoTransformer3DModel"
    ),
    "pipeline_longcat_video.py": PIPELINE,
    "context_parallel/context_parallel_util.py": SPLIT,
}


@pytest.fixture
def options(pipeline, tmp_path):
    """Options that name code, and weights of which tokenizer and encoder are real."""
    for name, text in MODULES.items():
        path = tmp_path / "code" / "longcat_video" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    weights = tmp_path / "weights"
    for part in ("tokenizer", "text_encoder"):
        shutil.copytree(pipeline / part, weights / part)
    for part in ("vae", "scheduler", "dit"):
        (weights / part).mkdir()
    (tmp_path / "mine.safetensors").write_bytes(b"weights")
    yield {
        "backend": "longcat",
        "checkpoint": str(weights),
        "checkout": str(tmp_path / "code"),
        "lora": str(tmp_path / "mine.safetensors"),
        "device": "cpu",
    }
    for name in [name for name in sys.modules if name.startswith("longcat_video")]:
        del sys.modules[name]


def test_calls_are_those_of_the_authors_and_the_prefix_is_never_returned(options):
    task = task_of("a", "gravity: [0.0, -9.8]\n", prefix=38, horizon=112)
    model = Vdm(**options)
    assert set(model.configuration) >= {"code_sha256", "lora_sha256"}
    (answer,) = model.predict(task)
    calls = sys.modules["longcat_video.pipeline_longcat_video"].CALLS
    text = "gravity 0 -9.8"
    assert calls[0][1] == ("dit", "torch.bfloat16", {"cp_split_hw": [1, 1]})
    assert calls[1:] == [("called", 13, 93, 13, text), ("called", 13, 45, 13, text)]
    assert answer.continuation.shape == (112, 32, 32, 3)
    levels = np.unique(answer.continuation).tolist()
    assert len(levels) == 2  # one of each call
    assert 128 not in levels


def test_the_same_task_gives_the_same_frames(options):
    first, second = (
        Vdm(**options).predict(task_of(prefix=6, horizon=4))[0].continuation
        for _ in range(2)
    )
    assert np.array_equal(first, second)
    other = Vdm(**options).predict(task_of("b", prefix=6, horizon=4))[0].continuation
    assert not np.array_equal(first, other)


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU")
def test_a_gpu_that_is_not_there_is_told(options):
    del options["device"]
    with pytest.raises(RuntimeError, match="backend longcat: needs a GPU"):
        _ = Vdm(**options).configuration


def test_code_that_is_not_there_is_told(options, tmp_path):
    options["checkout"] = str(tmp_path)
    with pytest.raises(FileNotFoundError, match="has no folder longcat_video; name a"):
        _ = Vdm(**options).configuration


def test_weights_that_are_not_there_are_told(options, tmp_path):
    options["checkpoint"] = str(tmp_path)
    with pytest.raises(FileNotFoundError, match="has no folder vae, scheduler, dit"):
        _ = Vdm(**options).configuration
