"""Rejection: draw candidates until one is a valid scene."""

import copy
from collections.abc import Callable
from typing import Any, TypeVar

from mpmworlds.sim.scene import Scene, SceneError

Data = dict[str, Any]
Accepted = TypeVar("Accepted")
MOST_DRAWS = 400


class NoCandidateError(RuntimeError):
    """No draw led to a valid scene."""


def first_valid(
    draw: Callable[[Data], Any],
    start: Data,
    accept: Callable[[Scene], Accepted],
    what: str,
) -> tuple[Accepted, Any]:
    """Apply a random edit to fresh copies of a scene until the result is valid.

    Parameters
    ----------
    draw : callable
        Edits plain scene data in place and returns a record of what it did.
    start : dict
        Plain data of the scene to start from.
    accept : callable
        Takes a valid scene to what is wanted of it; may raise `SceneError`.
    what : str
        Name of the sample, for the error.

    Returns
    -------
    Accepted
        What `accept` made of the first valid draw.
    object
        The record of that draw.

    Raises
    ------
    NoCandidateError
        After `MOST_DRAWS` draws, with the last fault.
    """
    fault = ""
    for _ in range(MOST_DRAWS):
        data = copy.deepcopy(start)
        record = draw(data)
        try:
            return accept(Scene.from_data(data, what)), record
        except SceneError as error:
            fault = str(error).splitlines()[0]
    raise NoCandidateError(
        f"{what}: none of {MOST_DRAWS} draws is a valid scene (last: {fault}); "
        "choose another scene to start from"
    )
