"""Predictors by name: the built-in ones, and any class that can be imported."""

import inspect
import pkgutil
from collections.abc import Callable, Mapping
from importlib import import_module
from types import MappingProxyType
from typing import Any, Final

from mpmworlds.baselines import simple
from mpmworlds.baselines.protocol import AnyPredictor

# Each has a module `predictor` with classes.
ROOMS: Final = ("search", "served", "small", "vdm", "vlm")
NO_OPTIONS: Final[Mapping[str, Any]] = MappingProxyType({})


def _built_in() -> Mapping[str, Callable[..., AnyPredictor]]:
    """Each module of `simple`, and each `predictor`, has classes with a name."""
    rooms = [f"mpmworlds.baselines.{room}.predictor" for room in ROOMS]
    modules = pkgutil.iter_modules(simple.__path__, f"{simple.__name__}.")
    found: dict[str, Callable[..., AnyPredictor]] = {}
    for place in [*(module.name for module in modules), *rooms]:
        for item in vars(import_module(place)).values():
            if isinstance(item, type) and item.__module__ == place:
                name = getattr(item, "name", None)
                if isinstance(name, str):
                    found[name] = item
    return MappingProxyType(dict(sorted(found.items())))


PREDICTORS: Final = _built_in()
"""Name -> class of the predictor."""


def predictor_named(name: str, options: Mapping[str, Any] = NO_OPTIONS) -> AnyPredictor:
    """Make a predictor.

    Parameters
    ----------
    name
        A key of `PREDICTORS`, or ``module:Class`` of what can be imported here.
    options
        What it is made with, by the names of its parameters.

    Returns
    -------
    Predictor, Oracle or Precomputed
        A new predictor.

    Raises
    ------
    ValueError
        If there is none of that name, or it takes other options.
    """
    made_by = _imported(name) if ":" in name else PREDICTORS.get(name)
    if made_by is None:
        raise ValueError(
            f"predictor {name!r}: unknown, must be one of {list(PREDICTORS)}, or "
            "module:Class of your own"
        )
    try:
        inspect.signature(made_by).bind(**options)
    except TypeError as error:
        takes = list(inspect.signature(made_by).parameters) or "none"
        raise ValueError(
            f"predictor {name!r}: {error}; its options are {takes}"
        ) from error
    predictor = made_by(**options)
    methods = ("predict", "reveal", "look_up")
    if not isinstance(getattr(predictor, "name", None), str) or not any(
        callable(getattr(predictor, method, None)) for method in methods
    ):
        raise ValueError(
            f"predictor {name!r}: is no predictor; it needs a name and a method "
            "predict(task), see mpmworlds.baselines.protocol"
        )
    return predictor


def _imported(name: str) -> Callable[..., AnyPredictor]:
    module, _, attribute = name.partition(":")
    try:
        found = getattr(import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise ValueError(
            f"predictor {name!r}: {error}; name a module that Python finds here (its "
            "folder in PYTHONPATH) and a class in it"
        ) from error
    if not callable(found):
        raise ValueError(f"predictor {name!r}: is no class")
    return found  # type: ignore[no-any-return]
