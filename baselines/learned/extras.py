"""Packages that a learned baseline needs beyond those that are always there."""

from importlib.util import find_spec


class MissingExtraError(RuntimeError):
    """A package is missing; the message has the command that installs it."""


def need(extra: str, *modules: str) -> None:
    """Raise unless some modules are installed.

    Parameters
    ----------
    extra
        Extra of this package that brings them.
    modules
        Names of what is imported.

    Raises
    ------
    MissingExtraError
        Names what is missing, and the command.
    """
    missing = [name for name in modules if find_spec(name) is None]
    if missing:
        raise MissingExtraError(
            f"{', '.join(missing)}: not installed; pip install 'mpmworlds[{extra}]'"
        )
