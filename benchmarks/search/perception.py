"""What search sees of prefixes before it simulates anything, beside the truth."""

import argparse
import math
import time
from collections import defaultdict
from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np
from benchmarks.search.rows import SPLITS, examples

from mpmworlds.baselines.search.assembly import scene_data
from mpmworlds.baselines.search.differences import apart, paired
from mpmworlds.baselines.search.guess import look
from mpmworlds.baselines.search.perception.colors import labels_of
from mpmworlds.baselines.search.perception.pixels import Pixels
from mpmworlds.baselines.search.prior import prior
from mpmworlds.baselines.search.side import Told
from mpmworlds.loaders.load import Example
from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.metrics.reduction import FRAMERATE
from mpmworlds.sim.scene.scene import Scene

Data = dict[str, Any]

QUANTILES: Final = (0.5, 0.9, 1.0)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add which samples."""
    parser.add_argument("--split", default="train", choices=SPLITS)
    parser.add_argument("--every", type=int, default=1, help="only each k-th sample")


def carry_out(options: argparse.Namespace) -> None:
    """Print what is wrong, then errors as quantiles."""
    errors: dict[str, list[float]] = defaultdict(list)
    start = time.process_time()
    chosen = examples(options.release, options.split, options.config, [])
    for example in chosen[:: options.every]:
        truth = Scene.from_yaml(example.row["scene"], example.id).to_data()
        found = seen(example)
        for what, error in compared(truth, found):
            errors[what].append(error)
            if what in ("wrong type", "wrong shape") and error:
                print(f"{example.id}: a {what}")
    seconds = (time.process_time() - start) / len(chosen[:: options.every])
    print(f"\n{seconds:.1f} s of a core a sample\n")
    print("\n".join(table(errors)))


def seen(example: Example) -> Data:
    """The first guess of a scene, in plain data."""
    usual, form = prior(), VideoForm.of_row(example.row)
    pixels = Pixels.of(example.prefix.shape[1], form.pixels)
    frame_time = usual.frame_time / min(example.framerate, FRAMERATE)
    told = Told()
    sight = look(labels_of(example.prefix), pixels, frame_time, told, seed=0)
    return scene_data(sight, told, form, usual, sight.gravities[0].value)


def compared(truth: Data, found: Data) -> Iterator[tuple[str, float]]:
    """Errors of the guess, each with what it is of."""
    one, other = (s["environment"]["gravity"] for s in (truth, found))
    yield "gravity [m/s^2]", math.dist(one, other)
    for thing, guess in paired(truth["objects"], found["objects"]):
        if thing is None:
            continue
        wrong = guess is None or guess["object_type"] != thing["object_type"]
        yield "wrong type", float(wrong)
        if guess is None or wrong:
            continue
        kind = thing["object_type"]
        if kind != "emitter":
            same = thing["shape"]["type"] == guess["shape"]["type"]
            yield "wrong shape", float(not same)
            if same:
                yield from _of_shape(thing, guess)
        else:
            yield "place of nozzles [m]", apart(thing, guess)
        yield from _of_motion(thing, guess)


def _of_shape(thing: Data, guess: Data) -> Iterator[tuple[str, float]]:
    kind = thing["object_type"]
    if thing["shape"]["type"] != "polygon":
        yield f"place of a {kind} [m]", apart(thing, guess)
    for key in ("radius", "size", "semi_axes"):
        if key in thing["shape"]:
            lengths = (np.sort(np.ravel(t["shape"][key])) for t in (thing, guess))
            one, other = lengths
            yield f"lengths of a {kind} [m]", float(np.abs(one - other).max())


def _of_motion(thing: Data, guess: Data) -> Iterator[tuple[str, float]]:
    if "initial_state" in thing:
        one, other = (t["initial_state"] for t in (thing, guess))
        yield "velocity of a body [m/s]", math.dist(one["velocity"], other["velocity"])
        spins = (t.get("angular_velocity", 0.0) for t in (one, other))
        yield "spin of a body [rad/s]", abs(next(spins) - next(spins))
    if "emission" in thing:
        one, other = (t["emission"] for t in (thing, guess))
        speeds = [math.hypot(*t["velocity"]) for t in (one, other)]
        yield "speed of a nozzle, relative", abs(math.log(speeds[1] / speeds[0]))
        yield "rate of a nozzle, relative", abs(math.log(other["rate"] / one["rate"]))
    if "kinematics" in thing:
        one, other = (t["kinematics"] for t in (thing, guess))
        yield "wrong law of motion", float(one["type"] != other["type"])
        if one["type"] == other["type"]:
            yield from _of_law(one, other)


def _of_law(
    one: Mapping[str, Any], other: Mapping[str, Any]
) -> Iterator[tuple[str, float]]:
    for key in ("angular_velocity", "frequency", "surface_speed"):
        if key in one:
            yield f"{key} of a collider, relative", abs(other[key] / one[key] - 1.0)
    if "velocity" in one:
        yield (
            "velocity of a collider [m/s]",
            math.dist(one["velocity"], other["velocity"]),
        )


def table(errors: Mapping[str, list[float]]) -> Iterator[str]:
    """Lines of a Markdown table."""
    yield "| error | n | median | 90 % | worst |"
    yield "|---|---|---|---|---|"
    for what, values in sorted(errors.items()):
        if what.startswith("wrong"):
            yield f"| {what} | {len(values)} | {sum(values):.0f} in all | | |"
        else:
            cells = [f"{v:.2g}" for v in np.quantile(values, QUANTILES)]
            yield f"| {what} | {len(values)} | {' | '.join(cells)} |"
