"""Numbers of a scene, one after the other: always the one that promises most."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from mpmworlds.baselines.search.trials.moves import Data, Move

LONGER: Final = 1.7  # a step after one that helped
SHORTER: Final = 0.4  # after one that helps to neither side
FAINTER: Final = 0.35  # what a number promises after it did not help
WORTH: Final = 6.0  # what it promises more for each part of the loss that it saved
STRIDES: Final = 3  # steps along one number at a time
APART: Final = 0.15  # of a step: what lies nearer is known


@dataclass
class Line:
    """One number, and what is known of changing it."""

    move: Move
    """What it changes."""
    hope: float
    """What it promises."""
    step: float
    """The next step."""

    def alive(self, finest: float) -> bool:
        """Whether its step is still so much of the first one."""
        return abs(self.step) >= finest * self.move.step


Tried = Callable[[Data, str], float]
"""Loss of a scene, and what it is called."""


def refine(
    data: Data,
    loss: float,
    moves: Sequence[Move],
    tried: Tried,
    finest: float,
    going: Callable[[], bool],
    known: dict[str, Line],
) -> tuple[Data, float]:
    """Change numbers of a scene while that lowers its loss.

    Parameters
    ----------
    data, loss
        The scene and its loss.
    moves
        What may be changed.
    tried
        Runs a scene.
    finest
        Part of its first step below which a step is not worth a run.
    going
        Asked before each number whether to go on.
    known
        By the names of moves, what is known of them from other scenes; kept up.

    Returns
    -------
    dict, float
        The best scene, and its loss.
    """
    lines = []
    for move in moves:
        line = Line(move, move.weight, move.step)
        if before := known.get(move.what):
            line.hope = before.hope
            line.step = max(before.step, finest * move.step, key=abs)
        known[move.what] = line
        lines.append(line)
    while going() and (alive := [line for line in lines if line.alive(finest)]):
        line = max(alive, key=lambda one: one.hope)  # the first of equal ones
        found, lower = _along(line, data, loss, tried)
        gain = loss - lower
        if gain > 0.0:
            line.hope *= min(1.0, FAINTER + WORTH * gain / loss)
        else:
            line.hope *= FAINTER
        data, loss = found, lower
    return data, loss


def _along(line: Line, data: Data, loss: float, tried: Tried) -> tuple[Data, float]:
    """A search along one number, from where it is; it sets the next step."""
    seen = {0.0: loss}

    def at(place: float) -> float:
        if place not in seen:
            seen[place] = tried(line.move.of(data, place), line.move.what)
        return seen[place]

    for step in (line.step, -line.step):
        if at(step) < loss:
            place = step
            for _ in range(STRIDES - 1):
                next_ = place + LONGER * (place - _before(seen, place))
                if at(next_) >= seen[place]:
                    break
                place = next_
            line.step = 0.5 * place
            break
    else:
        line.step *= SHORTER
    for place in _middle(seen):
        at(place)
    best = min(seen, key=lambda place: seen[place])
    return (line.move.of(data, best) if best else data), seen[best]


def _before(seen: dict[float, float], place: float) -> float:
    """The last place on the way to one."""
    nearer = [p for p in seen if p * place >= 0.0 and abs(p) < abs(place)]
    return max(nearer, key=abs)


def _middle(seen: dict[float, float]) -> Iterator[float]:
    """Bottom of the parabola through the best place and its neighbours."""
    places = sorted(seen)
    k = places.index(min(places, key=lambda place: seen[place]))
    if not 0 < k < len(places) - 1:
        return
    a, b, c = places[k - 1 : k + 2]
    left, right = (seen[a] - seen[b]) * (c - b), (seen[c] - seen[b]) * (b - a)
    if left + right <= 0.0:
        return
    bottom = b + 0.5 * (left * (c - b) - right * (b - a)) / (left + right)
    if min(bottom - a, abs(bottom - b), c - bottom) > APART * min(b - a, c - b):
        yield bottom
