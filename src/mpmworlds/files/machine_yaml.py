"""YAML that a program wrote, read back quickly."""

from typing import Any, Final

import yaml

# The parser in C is many times faster. What it lacks, such as refusing a key that is
# given twice, matters for files that people write.
_LOADER: Final[Any] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def read_machine_yaml(text: str) -> Any:
    """Return the plain data of a text; raises `yaml.YAMLError` if it is no YAML."""
    return yaml.load(text, Loader=_LOADER)  # noqa: S506 - a SafeLoader
