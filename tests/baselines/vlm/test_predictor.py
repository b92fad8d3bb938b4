"""The predictor: what is drawn, what decides it, and what is refused at once."""

import shutil
from dataclasses import replace

import pytest
import torch
from transformers import Qwen2_5_VLForConditionalGeneration

from mpmworlds.baselines.learned.devices import TooLittleMemoryError
from mpmworlds.baselines.learned.extras import MissingExtraError
from mpmworlds.baselines.learned.notes import CheckpointError
from mpmworlds.baselines.learned.writing import question
from mpmworlds.baselines.protocol import Failure, InfrastructureError
from mpmworlds.baselines.vlm.encoding import Encoder
from mpmworlds.baselines.vlm.predictor import CodeWriter
from mpmworlds.baselines.vlm.sampling import Sampling
from mpmworlds.baselines.vlm.writer import Reply, Where, Writer, read_ids

SHORT = {"candidates": 5, "samples_per_call": 2, "max_new_tokens": 12, "pictures": 2}


@pytest.fixture(scope="module")
def writer(checkpoint):
    return Writer(checkpoint, Where())


def texts(writer, task, how):
    asked = question(task, 2, "program", schema=False)
    return [reply.text for reply in writer.replies(asked, how, task.id)]


HOW = Sampling(5, 2, max_new_tokens=12)


def test_as_many_replies_are_drawn_as_were_wanted(writer, task):
    found = texts(writer, task, HOW)
    assert len(found) == len(set(found)) == 5


def test_draws_depend_on_seed_and_sample_alone(writer, task):
    found = texts(writer, task, HOW)
    other = replace(task, id="f" * 16)
    torch.manual_seed(7)
    state = torch.random.get_rng_state()
    assert texts(writer, other, HOW) != found
    assert texts(writer, task, HOW) == found, "whatever was drawn in between"
    assert texts(writer, task, replace(HOW, seed=1)) != found
    assert torch.equal(torch.random.get_rng_state(), state), "and nothing else changes"


def test_a_colder_model_says_the_likeliest_whatever_its_checkpoint_wants(writer, task):
    once = replace(HOW, candidates=1, temperature=0.0)
    assert texts(writer, task, once) == texts(writer, task, replace(once, seed=3))
    warm = texts(writer, task, replace(HOW, candidates=20, samples_per_call=20))
    assert len(set(warm)) > 15, "its own temperature is 1e-6"


def test_a_reply_that_does_not_end_is_a_failure_of_its_own(checkpoint, task):
    answers = CodeWriter(str(checkpoint), **SHORT).predict(task)
    assert len(answers) == 5
    for answer in answers:
        assert isinstance(answer, Failure)
        assert answer.outcome in ("truncated", "no_program")
    cut = [answer for answer in answers if answer.outcome == "truncated"]
    assert cut[0].reason == "no end within 12 tokens"


def test_a_reply_is_read_up_to_its_end(checkpoint):
    encoder = Encoder(checkpoint)
    ids = encoder.tokenizer("def frames<|im_end|>numpy")["input_ids"]
    ends = [encoder.tokenizer.eos_token_id]
    assert read_ids(ids, ends, encoder) == Reply("def frames", whole=True)
    assert not read_ids(ids[: ids.index(ends[0])], ends, encoder).whole


def test_what_decides_the_answers_is_told(checkpoint):
    told = CodeWriter(str(checkpoint), **SHORT).configuration
    assert told["checkpoint"] == "" and len(told["weights_sha256"]) == 64
    assert told["prompt"].startswith("mpmworlds-prompt/")
    assert told["extractor"].startswith("mpmworlds-extractor/")
    assert (told["candidates"], told["temperature"], told["dtype"]) == (
        5,
        1.0,
        "float32",
    )


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"candidates": 0}, "candidates = 0, must be at least 1"),
        ({"samples_per_call": 0}, "samples_per_call = 0"),
        ({"temperature": 0}, "all are the same; set candidates = 1"),
        ({"top_p": 1.5}, "top_p = 1.5"),
        ({"pictures": 1}, "pictures = 1, must be at least 2"),
        ({"task": "poem"}, "task = 'poem', must be one of program, scene"),
    ],
)
def test_impossible_options_are_refused(options, told):
    with pytest.raises(ValueError, match=told):
        CodeWriter(**options)


@pytest.mark.parametrize(
    ("options", "error", "told"),
    [
        ({"device": "cuda"}, RuntimeError, "sees no GPU; take 'cpu'"),
        ({"dtype": "int4"}, ValueError, "dtype = 'int4', must be auto or one of"),
        ({"checkpoint": "nowhere"}, CheckpointError, "no name on the Hub"),
    ],
)
@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU")
def test_what_is_not_there_is_told_before_anything_is_asked(
    checkpoint, options, error, told
):
    with pytest.raises(error, match=told):
        _ = CodeWriter(**{"checkpoint": str(checkpoint)} | options).configuration


def test_what_does_not_fit_is_told_with_what_would(checkpoint, monkeypatch):
    monkeypatch.setattr("mpmworlds.baselines.learned.devices.memory_of", lambda _: 1e6)
    told = "samples_per_call=1 needs .* device_map=auto .* 'served' asks"
    with pytest.raises(TooLittleMemoryError, match=told):
        _ = CodeWriter(str(checkpoint)).configuration


def test_a_model_of_another_family_is_refused(checkpoint, tmp_path):
    copy = shutil.copytree(checkpoint, tmp_path / "copy")
    (copy / "config.json").write_text('{"model_type": "gpt2"}')
    with pytest.raises(CheckpointError, match="is a model gpt2, must be qwen2_5_vl"):
        _ = CodeWriter(str(copy)).configuration


def test_memory_that_runs_out_is_no_failure_of_the_sample(writer, task, monkeypatch):
    def fails(self, **_):
        raise torch.OutOfMemoryError("CUDA out of memory.\nmore")

    monkeypatch.setattr(Qwen2_5_VLForConditionalGeneration, "generate", fails)
    with pytest.raises(InfrastructureError, match=r"samples_per_call = 2: CUDA out"):
        texts(writer, task, HOW)


def test_a_missing_package_is_told_with_the_command(monkeypatch):
    monkeypatch.setattr(
        "mpmworlds.baselines.learned.extras.find_spec",
        lambda name: None if name == "transformers" else name,
    )
    with pytest.raises(MissingExtraError, match=r"pip install 'mpmworlds\[vlm\]'"):
        CodeWriter()
