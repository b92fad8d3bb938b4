"""Numbers drawn from names: uniform, salted, independent of everything else."""

import hashlib

_STEPS = 1 << 53  # as many as a double's mantissa tells apart, so draws are exact


def uniform(salt: str, purpose: str, name: str) -> float:
    """Return the uniform number in (0, 1] that belongs to a name.

    Parameters
    ----------
    salt
        Text that sets this corpus apart from others with the same names.
    purpose
        What the draw decides. Draws of one name for two purposes are independent.
    name
        The subject, e.g. a sample id.

    Returns
    -------
    float
        (k + 1) / 2**53, with k the leading 53 bits of
        SHA-256(salt, NUL, purpose, NUL, name).
    """
    digest = hashlib.sha256("\0".join((salt, purpose, name)).encode()).digest()
    return ((int.from_bytes(digest[:8], "big") >> 11) + 1) / _STEPS
