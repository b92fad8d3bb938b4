"""Tensors and batches: the same for the same seed, whatever decodes them."""

import subprocess
import sys
from collections import Counter

import numpy as np
import pytest

from mpmworlds.loaders.load import load
from mpmworlds.loaders.torch import (
    TorchExamples,
    collate,
    data_loader,
    weighted_sampler,
)
from mpmworlds.loaders.weights import sampling_weights, weights_by_kind
from mpmworlds.splits.ids import SAMPLE_KINDS

torch = pytest.importorskip("torch")
torch.set_num_threads(
    1
)  # its threads wait by spinning, which a busy machine multiplies


@pytest.fixture
def examples(release, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return load(release, split="train", regime="frames_only")


def epochs(loader, count=2):
    return [[batch["id"] for batch in loader] for _ in range(count)]


def test_an_item_is_the_example_with_channels_before_rows(examples):
    for item, example in zip(TorchExamples(examples), examples, strict=True):
        assert (item["id"], item["framerate"]) == (example.id, example.framerate)
        assert item["side_info"] == example.side_info
        for name in ("prefix", "continuation"):
            tensor, frames = item[name], getattr(example, name)
            assert tensor.dtype == torch.uint8
            assert tensor.is_contiguous()
            np.testing.assert_array_equal(tensor.permute(0, 2, 3, 1), frames)


def test_a_prefix_alone_is_the_same_prefix(examples):
    whole, alone = TorchExamples(examples), TorchExamples(examples, prefix_only=True)
    assert set(alone[0]) == set(whole[0]) - {"continuation"}
    assert torch.equal(alone[0]["prefix"], whole[0]["prefix"])
    assert [item["id"] for item in alone[1:3]] == [e.id for e in examples[1:3]]


def test_a_batch_stacks_clips_and_lists_the_rest(examples):
    items = TorchExamples(examples)
    batch = collate([items[0], items[1]])
    assert batch["prefix"].shape == (2, 6, 3, 64, 64)
    assert batch["continuation"].shape == (2, 2, 3, 64, 64)
    assert batch["id"] == [items[0]["id"], items[1]["id"]]
    assert torch.equal(batch["prefix"][1], items[1]["prefix"])


def test_clips_of_different_shapes_are_named(examples):
    first, second = TorchExamples(examples)[0], TorchExamples(examples)[1]
    second["prefix"] = second["prefix"][:, :, :32]
    with pytest.raises(ValueError, match=r"p0000-c0: prefix has shape \(6, 3, 32, 64"):
        collate([first, second])


@pytest.mark.slow
@pytest.mark.parametrize("context", ["fork", "spawn"])
def test_workers_change_neither_order_nor_content(examples, context):
    dataset = TorchExamples(examples)
    alone = data_loader(dataset, 2, seed=3)
    started = {"multiprocessing_context": context, "persistent_workers": True}
    helped = data_loader(dataset, 2, seed=3, workers=2, **started)
    assert epochs(alone) == epochs(helped)
    batches = zip(data_loader(dataset, 2), helped, strict=True)
    found = {
        i: p for _, b in batches for i, p in zip(b["id"], b["prefix"], strict=True)
    }
    assert all(torch.equal(found[item["id"]], item["prefix"]) for item in dataset)


def test_a_seed_is_an_order(examples):
    dataset = TorchExamples(examples)
    orders = {seed: epochs(data_loader(dataset, 1, seed=seed)) for seed in range(5)}
    assert orders[0] == epochs(data_loader(dataset, 1, seed=0))
    assert len({str(order) for order in orders.values()}) > 1
    assert epochs(data_loader(dataset, 1), 1) == [[[e.id] for e in examples]]


def test_a_sampler_favours_templates(examples):
    sampler = weighted_sampler(examples, 0, 4000)
    counts = Counter(sampler)
    weights = np.array(sampling_weights(examples.table["kind"]))
    seen = np.array([counts[index] for index in range(len(examples))]) / 4000
    np.testing.assert_allclose(seen, weights / weights.sum(), atol=0.03)
    assert list(weighted_sampler(examples, 7)) == list(weighted_sampler(examples, 7))
    loader = data_loader(
        TorchExamples(examples), 1, sampler=weighted_sampler(examples, 7)
    )
    ids = [examples[index].id for index in weighted_sampler(examples, 7)]
    assert epochs(loader, 1) == [[[name] for name in ids]]


def test_a_sampler_brings_its_own_seed(examples):
    with pytest.raises(ValueError, match="seed = 1: a sampler has its own"):
        data_loader(
            TorchExamples(examples), 1, seed=1, sampler=weighted_sampler(examples, 7)
        )


def test_weights_are_those_of_the_subsets():
    assert set(weights_by_kind()) == set(SAMPLE_KINDS)
    assert sampling_weights(["seed", "child", "perturbation"]) == [8.0, 4.0, 1.0]


def test_torch_is_imported_only_when_it_is_used():
    probe = "import sys, mpmworlds.loaders.torch; print('torch' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", probe], capture_output=True, text=True, check=True
    )
    assert done.stdout == "False\n"
