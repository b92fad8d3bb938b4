"""Record checksums of the programs of the seeds: `python -m tests.sim.pin_programs`.

The text of a program decides the bits of its video. Whoever records new checksums
changes samples that have been released, and so raises the version of the package.
"""

import hashlib
import json
from pathlib import Path

from mpmworlds.builder.seeds import load_seeds
from mpmworlds.sim.program.link import link

PINNED = Path(__file__).with_name("program_sha256.json")


def checksums():
    """SHA-256 of the program text of every seed, by the name of the seed."""
    texts = {name: link(scene) for name, scene in load_seeds().items()}
    return {name: hashlib.sha256(t.encode()).hexdigest() for name, t in texts.items()}


if __name__ == "__main__":
    PINNED.write_text(json.dumps(checksums(), indent=2) + "\n", "utf-8")
