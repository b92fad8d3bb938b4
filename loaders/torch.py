"""Examples as tensors, in batches, for PyTorch (`pip install 'mpmworlds[torch]'`).

Order and content follow from the seed alone: indices are drawn in the main process and
decoding draws nothing, so the number of workers, and how they are started, change
nothing. Torch is imported when something here is used, not before.
"""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from mpmworlds.loaders.clips import clip_of
from mpmworlds.loaders.load import Examples, side_info_of
from mpmworlds.loaders.weights import sampling_weights
from mpmworlds.metrics.reduction import Frames, split_clip

CLIPS: Final = ("prefix", "continuation")
Item = dict[str, Any]


class TorchExamples(Sequence[Item]):
    """A map-style dataset over examples; it goes to workers by fork and by spawn.

    An item has `id`, `side_info` (both texts), `framerate` [1/s], and `prefix` and
    `continuation`, uint8 tensors of shape (T, C, H, W), C being R, G, B.

    Parameters
    ----------
    examples
        What `mpmworlds.load` returns.
    prefix_only
        Leave the continuation out, which takes a quarter of the time.
    """

    def __init__(self, examples: Examples, *, prefix_only: bool = False) -> None:
        self.examples = examples
        self.prefix_only = prefix_only

    def __len__(self) -> int:
        return len(self.examples)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return TorchExamples(self.examples[index], prefix_only=self.prefix_only)
        row = self.examples.table[int(index)]
        clip = clip_of(row, prefix_only=self.prefix_only)
        item = {
            "id": row["id"],
            "side_info": side_info_of(row, self.examples.regime),
            "framerate": clip.framerate,
        }
        if self.prefix_only:
            return item | {"prefix": _tensor(clip.frames)}
        prefix, continuation = map(_tensor, split_clip(*clip))
        return item | {"prefix": prefix, "continuation": continuation}


def collate(items: Sequence[Item]) -> Item:
    """A batch: clips stacked, uint8 (B, T, C, H, W), and lists of all the rest.

    Raises
    ------
    ValueError
        If clips differ in shape; names two samples.
    """
    import torch

    batch: Item = {}
    for key in items[0]:
        values = [item[key] for item in items]
        if key not in CLIPS:
            batch[key] = values
            continue
        for item in items:
            if item[key].shape != values[0].shape:
                shape, first = tuple(item[key].shape), tuple(values[0].shape)
                raise ValueError(
                    f"{item['id']}: {key} has shape {shape}, must be {first} as that "
                    f"of {items[0]['id']}; use batches of 1, or one configuration"
                )
        batch[key] = torch.stack(values)
    return batch


def weighted_sampler(
    examples: Examples, seed: int, num_samples: int | None = None
) -> Any:
    """A sampler that favours templates over their perturbations, as `10k` does.

    Parameters
    ----------
    examples
        What is sampled, with replacement.
    seed
        Of its own generator; the next epoch goes on from where it is.
    num_samples
        How many are drawn for an epoch; as many as there are if left out.

    Returns
    -------
    torch.utils.data.WeightedRandomSampler
        For the argument `sampler` of a `DataLoader`, or of `data_loader`.
    """
    from torch.utils.data import WeightedRandomSampler

    weights = sampling_weights(examples.table["kind"])
    count = len(weights) if num_samples is None else num_samples
    return WeightedRandomSampler(weights, count, generator=_generator(seed))


def data_loader(
    dataset: TorchExamples,
    batch_size: int,
    *,
    seed: int | None = None,
    sampler: Any = None,
    workers: int = 0,
    **options: Any,
) -> Any:
    """A `DataLoader` of batches of `collate`.

    Parameters
    ----------
    dataset
        What is loaded.
    batch_size
        Items of a batch.
    seed
        Of the order; without it, and without a sampler, that of the dataset. The same
        seed gives the same epochs, one after another, whatever the number of workers.
    sampler
        Another order, as that of `weighted_sampler`.
    workers
        Processes that decode; 0 for this one.
    options
        Others of `torch.utils.data.DataLoader`, as `multiprocessing_context`.

    Returns
    -------
    torch.utils.data.DataLoader
        Batches as `collate` makes them.

    Raises
    ------
    ValueError
        If there are both a seed and a sampler, which has its own.
    """
    from torch.utils.data import DataLoader, RandomSampler

    if seed is not None and sampler is not None:
        raise ValueError(f"seed = {seed}: a sampler has its own; leave one out")
    if seed is not None:
        # With a generator of its own: how often a loader draws seeds for its workers
        # depends on whether they persist.
        sampler = RandomSampler(dataset, generator=_generator(seed))
    return DataLoader(
        dataset,  # type: ignore[arg-type,unused-ignore]
        batch_size,
        sampler=sampler,
        num_workers=workers,
        collate_fn=collate,
        **options,
    )


def _generator(seed: int) -> Any:
    import torch

    return torch.Generator().manual_seed(seed)


def _tensor(frames: Frames) -> Any:
    """Frames (T, H, W, C) as a tensor (T, C, H, W) of its own memory."""
    import torch

    return torch.from_numpy(np.ascontiguousarray(frames.transpose(0, 3, 1, 2)))
