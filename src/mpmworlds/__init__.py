"""MPMWorlds: 2D Material Point Method worlds as programs, scenes and videos.

Importing this package is light. Names below are loaded when they are first used, and
`datasets.load_dataset("mpmworlds")` finds the release from then on.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from mpmworlds.files import posix
from mpmworlds.loaders import alias

if TYPE_CHECKING:
    from mpmworlds import metrics as metrics
    from mpmworlds.loaders.load import load as load
    from mpmworlds.sim.program.link import link as link
    from mpmworlds.sim.run.run import run as run
    from mpmworlds.sim.scene.scene import Scene as Scene

__version__ = "0.1.0"
__all__ = ["Scene", "link", "load", "metrics", "run"]

_HOMES = {
    "Scene": "mpmworlds.sim.scene.scene",
    "link": "mpmworlds.sim.program.link",
    "load": "mpmworlds.loaders.load",
    "run": "mpmworlds.sim.run.run",
}

alias.install()


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name in _HOMES:
        try:
            home = import_module(_HOMES[name])
        except ModuleNotFoundError as error:
            if error.name in posix.MODULES:
                raise posix.NotPosixError(error.name) from None
            raise
        return getattr(home, name)
    if name == "metrics":
        return import_module("mpmworlds.metrics")
    raise AttributeError(f"module 'mpmworlds' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
