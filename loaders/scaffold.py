"""The scaffold: what every program must be, and a skeleton of one, without a scene.

It is the same text for each scene, so it gives none away.
"""

from importlib.resources import files
from typing import Any, Final

import yaml


def read_wording(name: str) -> dict[str, Any]:
    """A file of texts that comes with the package."""
    folder = files("mpmworlds.loaders").joinpath("wording")
    texts = yaml.safe_load(folder.joinpath(f"{name}.yaml").read_text("utf-8"))
    return dict(texts)


_TEXTS: Final = read_wording("scaffold")
SCAFFOLD_VERSION: Final[str] = _TEXTS["version"]
RULES: Final[str] = _TEXTS["rules"]
"""What a program imports, yields, draws and takes."""
SKELETON: Final[str] = _TEXTS["skeleton"]
"""A program that runs and shows nothing, with the sections that the corpus's have."""
