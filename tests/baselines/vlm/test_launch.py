"""What is shipped for several GPUs says what the launcher and torch understand."""

import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest
import transformers.models.qwen2_5_vl.modeling_qwen2_5_vl as modeling
from accelerate.commands.launch import (
    _validate_launch_command,
    launch_command_parser,
)
from accelerate.utils import FullyShardedDataParallelPlugin, prepare_multi_gpu_env

from mpmworlds.baselines.vlm.training import TrainingSettings
from mpmworlds.cli import parser

LAUNCH = files("mpmworlds.baselines.vlm") / "launch"
FILES = sorted(entry.name for entry in LAUNCH.iterdir())
TRAIN = ["-m", "mpmworlds", "train", "vlm", "--recipe", "paper"]


@pytest.mark.parametrize("name", FILES)
def test_the_launcher_shards_the_layers_of_the_model(name, monkeypatch):
    arguments = ["--config_file", str(LAUNCH / name), *TRAIN]
    options = launch_command_parser().parse_args(arguments)
    options, *_ = _validate_launch_command(options)
    assert options.module and options.training_script == "mpmworlds"
    parser().parse_args(options.training_script_args)
    told = {**prepare_multi_gpu_env(options)}
    for key, value in told.items():
        if key.startswith(("FSDP", "ACCELERATE")):
            monkeypatch.setenv(key, value)
    assert told["ACCELERATE_USE_FSDP"] == "true"
    assert told["FSDP_ACTIVATION_CHECKPOINTING"] == "true"
    plugin = FullyShardedDataParallelPlugin()
    assert plugin.fsdp_version == 2
    assert plugin.reshard_after_forward is True
    assert plugin.activation_checkpointing and plugin.cpu_ram_efficient_loading
    assert "FULL_STATE_DICT" in str(plugin.state_dict_type)
    wrapped = plugin.transformer_cls_names_to_wrap
    assert len(wrapped) == 2
    assert all(hasattr(modeling, layer) for layer in wrapped)


def test_recipes_are_settings_and_the_paper_s_are_the_defaults():
    assert {"paper", "tiny"} <= set(TrainingSettings.recipes())
    for name in TrainingSettings.recipes():
        TrainingSettings.read(name)
    assert TrainingSettings.read("paper") == TrainingSettings()


@pytest.mark.slow
def test_shards_learn_what_a_whole_model_learns(checkpoint):
    script = Path(__file__).with_name("sharded.py")
    done = subprocess.run(
        [
            *(sys.executable, "-m", "torch.distributed.run", "--nproc_per_node", "2"),
            *("--standalone", script, checkpoint),
        ],
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert done.returncode == 0, done.stderr
    assert "returned a view tensor" not in done.stderr
