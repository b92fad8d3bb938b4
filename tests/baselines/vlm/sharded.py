"""A model in shards of two processes has the gradients of a whole one; run by torchrun.

What `accelerate launch` does with the shipped file, without a GPU: layers and the rest
sharded by FSDP2, gathered when they are needed, and the loss in chunks.
"""

import sys

import torch
import torch.distributed as dist
from torch.distributed.device_mesh import init_device_mesh
from torch.distributed.fsdp import fully_shard
from transformers import AutoModelForImageTextToText

from mpmworlds.baselines.vlm.learning.loss import UNSEEN, chunk_loss

PROMPT, TOKENS = 40, 90


def batch_of(rank):
    """A prompt and an answer of tokens that mean nothing, another for each process."""
    generator = torch.Generator().manual_seed(rank)
    ids = torch.randint(0, 500, (1, TOKENS), generator=generator)
    labels = ids.clone()
    labels[:, :PROMPT] = UNSEEN
    kept = TOKENS - PROMPT + 1
    return {
        "input_ids": ids,
        "attention_mask": torch.ones_like(ids),
        "labels": labels[:, -kept:],
        "logits_to_keep": kept,
    }


def main(checkpoint):
    dist.init_process_group("gloo")
    world = dist.get_world_size()
    whole = AutoModelForImageTextToText.from_pretrained(checkpoint)
    (sum(whole(**batch_of(rank)).loss for rank in range(world)) / world).backward()
    expected = {name: one.grad for name, one in whole.named_parameters()}
    model = AutoModelForImageTextToText.from_pretrained(checkpoint)
    chunk_loss(model, 16)
    mesh = init_device_mesh("cpu", (world,))
    for layer in [*model.model.language_model.layers, *model.model.visual.blocks]:
        fully_shard(layer, mesh=mesh, reshard_after_forward=True)
    fully_shard(model, mesh=mesh, reshard_after_forward=True)
    loss = model(**batch_of(dist.get_rank())).loss
    loss *= 1.0  # as `Trainer` does, in place
    loss.backward()
    compared = 0
    for name, one in model.named_parameters():
        if expected[name] is not None:  # no picture is seen
            torch.testing.assert_close(one.grad.full_tensor(), expected[name])
            compared += 1
    assert compared == 1 + 1 + 1 + 12 * 2, compared  # words twice, norm, two layers
    dist.destroy_process_group()


if __name__ == "__main__":
    main(sys.argv[1])
