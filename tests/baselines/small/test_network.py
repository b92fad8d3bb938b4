"""The network and what it does frame after frame."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from mpmworlds.baselines.small.fields import FEATURES  # noqa: E402
from mpmworlds.baselines.small.learning.losses import unrolled  # noqa: E402
from mpmworlds.baselines.small.network import LabelUNet, Shape  # noqa: E402
from mpmworlds.baselines.small.rollout import (  # noqa: E402
    areas_of,
    continued,
    held,
)
from mpmworlds.baselines.small.slots import CLASSES, UNKNOWN  # noqa: E402


def network_of(patch=1, told=0, context=2, horizon=2):
    with torch.random.fork_rng():
        torch.manual_seed(0)
        return LabelUNet(Shape(context, horizon, (16, 32), 1, patch, told))


def moving(frames, side=16, speed=2, label=3):
    """A square that moves to the right and comes in again on the left."""
    clip = np.zeros((frames, side, side), np.uint8)
    for t in range(frames):
        clip[t, 4:9, (speed * t + np.arange(5)) % side] = label
    return clip


@pytest.mark.parametrize(("patch", "told"), [(1, 0), (2, 0), (1, 8)])
def test_before_training_everything_stays_where_it_is(patch, told):
    network = network_of(patch, told)
    seen = moving(5)
    fields = np.ones((CLASSES, FEATURES), np.float32) if told else None
    found = continued(network, seen, 7, fields)
    assert (found.dtype, found.shape) == (np.uint8, (7, 16, 16))
    assert (found == seen[-1]).all()


@pytest.mark.parametrize("side", [13, 16, 22])
@pytest.mark.parametrize("frames", [1, 2, 9])
def test_any_size_and_length_is_continued(side, frames):
    found = continued(network_of(patch=2), moving(frames, side), 3)
    assert found.shape == (3, side, side)


def test_what_is_in_doubt_does_not_wear_away():
    # A square whose right half is a little less likely than background.
    logits = torch.zeros(1, 1, CLASSES, 16, 16)
    logits[:, :, 0] = 1.0
    logits[:, :, 3, 4:12, 4:8], logits[:, :, 3, 4:12, 8:12] = 3.0, 0.5
    free = held(logits, torch.zeros(1, 1, CLASSES))
    assert int((free == 3).sum()) == 32
    bound = torch.zeros(1, 1, CLASSES)
    bound[..., 3] = 60.0
    labels = held(logits, bound)
    assert ((labels == 3)[0, 0].nonzero() >= 4).all()
    assert int((labels == 3).sum()) == 64
    assert float(areas_of(labels)[0, 0, 3]) == 64.0
    assert set(labels.unique().tolist()) == {0, 3}


def test_what_covers_enough_is_left_as_it_is():
    generator = torch.Generator().manual_seed(0)
    logits = torch.randn(1, 2, CLASSES, 16, 16, generator=generator)
    expected = logits.max(dim=2).indices
    areas = areas_of(expected).min(dim=1, keepdim=True).values
    assert torch.equal(held(logits, areas), expected)


def test_nothing_is_nothing_more():
    assert continued(network_of(), moving(3), 0).shape == (0, 16, 16)


def test_what_is_told_changes_what_is_predicted():
    network = network_of(told=8)
    with torch.no_grad():  # the head is 0 before training
        network.head.weight.fill_(0.01)
        labels = torch.from_numpy(moving(2)).long()[None]
        one, other = (
            network(labels, torch.full((1, CLASSES, FEATURES), value))
            for value in (0.0, 1.0)
        )
    assert not torch.equal(one, other)


def test_losses_are_those_of_a_formula_written_out():
    network = network_of()
    with torch.no_grad():
        network.head.bias.normal_(generator=torch.Generator().manual_seed(1))
    labels = torch.from_numpy(moving(4)).long()[None]
    labels[0, 2, 0, 0] = UNKNOWN
    ((loss, changed, right),) = unrolled(network, labels, None, 2, 3.0)
    chances = torch.softmax(network(labels[:, :2]), dim=2)[0].detach()
    costs, weights, moved, hits = 0.0, 0.0, 0, 0
    for t, y, x in np.ndindex(2, 16, 16):
        target, before = int(labels[0, 2 + t, y, x]), int(labels[0, 1, y, x])
        if target == UNKNOWN:
            continue
        weight = 3.0 if target != before else 1.0
        costs -= weight * float(torch.log(chances[t, target, y, x]))
        weights += weight
        moved += target != before
        hits += target != before and int(chances[t, :, y, x].argmax()) == target
    assert float(loss.detach()) == pytest.approx(costs / weights, rel=1e-5)
    assert (int(changed), int(right)) == (moved, hits)


def test_what_was_predicted_is_seen_next():
    network = network_of()
    labels = torch.from_numpy(moving(8)).long()[None]
    losses = [
        float(loss.detach()) for loss, *_ in unrolled(network, labels, None, 2, 1.0)
    ]
    assert len(losses) == 3
    # It predicts that nothing moves, so the square of frame 1 is what it goes on with.
    still = labels.clone()
    still[:, 2:6] = labels[:, 1:2]
    (expected,) = unrolled(
        network, torch.cat([still[:, 4:6], labels[:, 6:8]], dim=1), None, 2, 1.0
    )
    assert losses[2] == pytest.approx(float(expected[0].detach()), rel=1e-6)


def test_a_motion_is_learned():
    network = network_of(patch=2, context=3, horizon=1)
    optimizer = torch.optim.AdamW(network.parameters(), lr=3e-3)
    clip = torch.from_numpy(moving(16)).long()
    windows = torch.stack([clip[t : t + 5] for t in range(11)])
    for _ in range(60):
        optimizer.zero_grad()
        for loss, _, _ in unrolled(network, windows, None, 3, 4.0):
            loss.backward()
        optimizer.step()
    found = continued(network.eval(), moving(6), 10)
    truth = moving(16)[6:]
    there, both = (found == 3) | (truth == 3), (found == 3) & (truth == 3)
    assert both.sum() / there.sum() > 0.9
