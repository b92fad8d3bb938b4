"""Random numbers that belong to a name: adding samples never changes other samples."""

import hashlib

import numpy as np


def stream(root_seed: int, *names: str) -> np.random.Generator:
    """Counter-based generator (Philox) keyed by a root seed and a path of names."""
    text = "\0".join([str(root_seed), *names])
    digest = hashlib.sha256(text.encode()).digest()
    return np.random.Generator(np.random.Philox(key=int.from_bytes(digest[:16], "big")))
