"""The built-in predictors by name."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

from mpmworlds.baselines.black import Black
from mpmworlds.baselines.copy_last import CopyLast
from mpmworlds.baselines.oracle import OracleProgram
from mpmworlds.baselines.protocol import AnyPredictor

PREDICTORS: Final[Mapping[str, Callable[[], AnyPredictor]]] = MappingProxyType(
    {"black": Black, "copy_last": CopyLast, "oracle": OracleProgram}
)
"""Name -> maker of the predictor."""


def predictor_named(name: str) -> AnyPredictor:
    """Make a built-in predictor.

    Parameters
    ----------
    name
        A key of `PREDICTORS`.

    Returns
    -------
    Predictor or Oracle
        A new predictor of that name.

    Raises
    ------
    ValueError
        If there is none (the message lists them).
    """
    if name not in PREDICTORS:
        raise ValueError(
            f"predictor {name!r}: unknown, must be one of {list(PREDICTORS)}"
        )
    return PREDICTORS[name]()
