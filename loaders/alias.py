"""Make ``load_dataset("mpmworlds")`` find a release, without importing ``datasets``.

A name without an owner cannot be had on the Hub, so the name is looked up here. Only
the one function of ``datasets`` that turns a path into a dataset is wrapped, when
``datasets`` is imported; all that follows (streaming, column selection, several
processes, ``get_dataset_config_names``) works as for any other path.
"""

import functools
import sys
from collections.abc import Callable, Sequence
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Any, Final

_MODULE: Final = "datasets.load"
_FUNCTION: Final = "dataset_module_factory"
_MARK: Final = "_mpmworlds_alias"


def install() -> None:
    """Teach ``datasets`` the name, now or as soon as it is imported. Idempotent."""
    if _MODULE in sys.modules:
        for name in (_MODULE, "datasets.inspect"):  # the latter has its own reference
            if name in sys.modules:
                _wrap(sys.modules[name])
    elif not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Finder())


class _Finder:
    """Finds ``datasets.load``, and has it wrapped whenever it has been executed."""

    def find_spec(
        self,
        fullname: str,
        path: Sequence[str] | None,
        target: ModuleType | None = None,
    ) -> ModuleSpec | None:
        if fullname != _MODULE:
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def exec_module(module: ModuleType) -> None:
                execute(module)
                _wrap(module)

            # The loader belongs to this one module, so nothing else is changed.
            spec.loader.exec_module = exec_module  # type: ignore[method-assign]
        return spec


def _wrap(module: ModuleType) -> None:
    original: Callable[..., Any] = getattr(module, _FUNCTION)
    if hasattr(original, _MARK):
        return

    @functools.wraps(original)
    def dataset_module_factory(path: str, *args: Any, **kwargs: Any) -> Any:
        # Here, because importing this costs more than `import mpmworlds` may.
        from mpmworlds.loaders.modules import module_of

        return module_of(original, path, *args, **kwargs)

    setattr(dataset_module_factory, _MARK, True)
    setattr(module, _FUNCTION, dataset_module_factory)
