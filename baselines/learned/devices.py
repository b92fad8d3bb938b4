"""Where a model runs, and whether it fits there."""

import os
from typing import Any, Final

GIB: Final = 2**30


class TooLittleMemoryError(RuntimeError):
    """A model does not fit; the message says what would."""


def device_named(name: str = "auto") -> Any:
    """A device of torch.

    Parameters
    ----------
    name
        ``auto`` is the first GPU if there is one, else the processor; or a name as
        torch has them.

    Returns
    -------
    torch.device
        It is there.

    Raises
    ------
    RuntimeError
        If it is not there.
    """
    import torch

    if name == "auto":
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    try:
        device = torch.device(name)
    except RuntimeError as error:
        raise RuntimeError(f"device {name!r}: {str(error).splitlines()[0]}") from None
    if device.type == "cuda" and not torch.cuda.is_available():
        raise RuntimeError(
            f"device {name!r}: torch {torch.__version__} sees no GPU; take 'cpu', or "
            "install a CUDA build of torch"
        )
    return device


def memory_of(device: Any) -> int:
    """Memory of a device [bytes]: that of the GPU, or of this machine."""
    import torch

    if device.type == "cuda":
        return int(torch.cuda.get_device_properties(device).total_memory)
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


def check_fits(what: str, needed: float, device: Any, remedy: str) -> None:
    """Raise if something does not fit on a device.

    Parameters
    ----------
    what
        Its name, for the message.
    needed
        Its memory [bytes].
    device
        Of torch.
    remedy
        What would fit.

    Raises
    ------
    TooLittleMemoryError
        If it needs more than there is.
    """
    there = memory_of(device)
    if needed > there:
        raise TooLittleMemoryError(
            f"{what}: needs about {needed / GIB:.0f} GiB, {device} has "
            f"{there / GIB:.0f} GiB; {remedy}"
        )
