"""Finetuning: what is learned from, going on, and what is refused."""

import json
import shutil

import numpy as np
import pytest
import torch
from safetensors.torch import load_file
from transformers import AutoModelForImageTextToText

from mpmworlds.baselines.learned.devices import TooLittleMemoryError
from mpmworlds.baselines.learned.notes import NOTE
from mpmworlds.baselines.vlm.encoding import Encoder
from mpmworlds.baselines.vlm.learning.examples import (
    UNSEEN,
    Asking,
    Chats,
    Collator,
    lengths,
    order_of,
)
from mpmworlds.baselines.vlm.learning.loss import chunk_loss
from mpmworlds.baselines.vlm.learning.run import last_checkpoint
from mpmworlds.baselines.vlm.settings import CHECKPOINTS, LOG, TrainingSettings
from mpmworlds.baselines.vlm.training import train
from mpmworlds.loaders.export.folder import Source
from mpmworlds.loaders.prompts import answer_of

ASKING = Asking("program", 2)


def settings(checkpoint, **changed):
    """Those of the shipped recipe for processors."""
    return TrainingSettings.read("tiny", {"checkpoint": str(checkpoint), **changed})


@pytest.fixture(scope="module")
def source(release):
    return Source(release, "tiny", "train", "frames_only")


@pytest.fixture(scope="module")
def encoder(checkpoint):
    return Encoder(checkpoint)


@pytest.fixture(scope="module")
def trained(source, checkpoint, tmp_path_factory):
    """Three steps over five samples, with a checkpoint after each."""
    out = tmp_path_factory.mktemp("trained") / "out"
    train(source, settings(checkpoint, keep=3), out, progress=False)
    return out


def weights(folder):
    return load_file(folder / "model.safetensors")


def same(one, two):
    return one.keys() == two.keys() and all(torch.equal(one[k], two[k]) for k in one)


def batch_of(source, encoder, places=(0, 1)):
    chats = Chats(source.load(), np.arange(5), encoder, ASKING)
    items = [chats[place] for place in places]
    return items, Collator(encoder.tokenizer.pad_token_id, encoder.pad)(items)


def test_the_answer_alone_is_learned(source, encoder):
    items, batch = batch_of(source, encoder)
    rows = source.load().table
    for number, item in enumerate(items):
        taught = [token for token in item["labels"] if token != UNSEEN]
        text = encoder.tokenizer.decode(taught)
        assert text == answer_of(rows[number], "program") + "<|im_end|>"
    ids, labels = batch["input_ids"], batch["labels"]
    kept = batch["logits_to_keep"]
    assert labels.shape == (2, kept)
    seen = labels != UNSEEN
    assert torch.equal(ids[:, -kept:][seen], labels[seen])
    assert not seen[:, 0].any(), "the first place of all has nothing before it"
    assert not (labels == encoder.tokenizer.pad_token_id).any()


def test_a_loss_of_fewer_logits_is_that_of_all(source, encoder, checkpoint):
    _, batch = batch_of(source, encoder, (0, 4))
    model = AutoModelForImageTextToText.from_pretrained(checkpoint).eval()
    whole = torch.full_like(batch["input_ids"], UNSEEN)
    whole[:, -batch["logits_to_keep"] :] = batch["labels"]
    with torch.no_grad():
        few = model(**batch)
        every = model(**batch | {"labels": whole, "logits_to_keep": 0})
    assert few.logits.shape[1] < every.logits.shape[1] / 2
    torch.testing.assert_close(few.loss, every.loss)


def test_a_loss_in_chunks_is_that_of_all_at_once(source, encoder, checkpoint):
    _, batch = batch_of(source, encoder, (0, 4))
    found = []
    for size in (0, 16):
        model = AutoModelForImageTextToText.from_pretrained(checkpoint)
        if size:
            chunk_loss(model, size)
        loss = model(**batch).loss
        weighed = model(**batch, num_items_in_batch=torch.tensor(7)).loss
        loss.backward()
        grads = {name: one.grad for name, one in model.named_parameters()}
        found.append((loss, weighed, grads))
        assert model.state_dict().keys() == grads.keys()
    torch.testing.assert_close(found[1], found[0])


def test_lengths_are_those_of_what_is_trained_on(source, encoder):
    items, _ = batch_of(source, encoder, range(5))
    told = list(lengths(source.load(), encoder, ASKING))
    assert told == [len(item["input_ids"]) for item in items]


@pytest.mark.parametrize("weighted", [False, True])
def test_a_longer_order_begins_like_a_shorter_one(weighted):
    kinds = ["parent", "perturbation", "perturbation", "child"]
    long = order_of(kinds, 4000, 0, weighted=weighted)
    short = order_of(kinds, 10, 0, weighted=weighted)
    assert long[:10].tolist() == short.tolist()
    counts = np.bincount(long, minlength=4)
    if weighted:
        assert counts[0] > 1.2 * counts[1] > 0
    else:
        assert set(counts) == {1000}


def test_a_training_ends_with_a_model_that_loads(trained, checkpoint):
    note = json.loads((trained / NOTE).read_text())
    assert (note["family"], note["steps"]) == ("vlm", 3)
    assert note["made_of"]["samples"] == 5
    before, after = weights(checkpoint), weights(trained)
    assert before.keys() == after.keys()
    still = [name for name in before if torch.equal(before[name], after[name])]
    assert still == [], "all weights are finetuned, the vision tower's as well"
    AutoModelForImageTextToText.from_pretrained(trained)
    assert Encoder(trained).pad == Encoder(checkpoint).pad
    logged = json.loads((trained / LOG).read_text())
    assert sum("loss" in one for one in logged) == 3


def test_a_training_that_was_stopped_goes_on_as_if_it_had_not(
    trained, source, checkpoint, tmp_path
):
    out = tmp_path / "out"
    shutil.copytree(trained / CHECKPOINTS, out / CHECKPOINTS)
    half = out / CHECKPOINTS / "checkpoint-3" / "trainer_state.json"
    half.write_text(half.read_text()[:50])  # killed while it was written
    begun = last_checkpoint(out / CHECKPOINTS)
    assert begun.name == "checkpoint-2"
    assert not same(weights(begun), weights(checkpoint))
    train(source, settings(checkpoint, keep=3), out, progress=False)
    assert same(weights(out), weights(trained))
    assert (out / NOTE).read_text() == (trained / NOTE).read_text()


def test_half_precision_is_what_is_computed_in_and_written(
    source, checkpoint, tmp_path
):
    halved = settings(checkpoint, half=True, checkpointing=True, save_steps=9)
    train(source, halved, tmp_path / "out", progress=False)
    written = weights(tmp_path / "out")
    assert {one.dtype for one in written.values()} == {torch.bfloat16}
    found = AutoModelForImageTextToText.from_pretrained(tmp_path / "out")
    assert found.dtype == torch.bfloat16


def test_a_training_that_is_done_is_not_done_again(trained, source, checkpoint):
    before = (trained / "model.safetensors").stat().st_mtime_ns
    assert train(source, settings(checkpoint, keep=3), trained) == trained
    assert (trained / "model.safetensors").stat().st_mtime_ns == before


def test_another_training_is_not_mixed_in(trained, source, checkpoint):
    with pytest.raises(ValueError, match=r"learning_rate = 0\.001, not 0\.1"):
        train(source, settings(checkpoint, keep=3, learning_rate=0.1), trained)


def test_long_samples_are_left_out_and_told(
    source, checkpoint, encoder, tmp_path, caplog
):
    sizes = sorted(lengths(source.load(), encoder, ASKING))
    most = sizes[-2] if sizes[-2] < sizes[-1] else sizes[0]
    kept = sum(size <= most for size in sizes)
    out = tmp_path / "out"
    train(source, settings(checkpoint, max_tokens=most), out, progress=False)
    told = json.loads((out / NOTE).read_text())["made_of"]
    assert (told["samples"], told["left_out"]) == (kept, 5 - kept)
    assert f"{5 - kept} of 5 samples are left out: more than {most}" in caplog.text


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"max_tokens": 10}, "every sample is longer, the shortest has"),
        ({"batch": 3, "per_device": 2}, "must be a multiple of 2"),
    ],
)
def test_what_cannot_be_done_is_told_why(changed, told, source, checkpoint, tmp_path):
    with pytest.raises(ValueError, match=told):
        train(source, settings(checkpoint, **changed), tmp_path / "out")


def test_what_does_not_fit_is_told_before_it_is_loaded(
    source, checkpoint, tmp_path, monkeypatch
):
    monkeypatch.setattr("mpmworlds.baselines.learned.devices.memory_of", lambda _: 1e6)
    with pytest.raises(TooLittleMemoryError, match="accelerate launch --config_file"):
        train(source, settings(checkpoint), tmp_path / "out")
