"""Settings of a training: a shipped recipe or a file, and what is set beside it."""

from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any, Self

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from mpmworlds.files.text import read_text


class Settings(BaseModel):
    """Numbers of a training; a family derives its own, in a module ``training``.

    Recipes are YAML files in the folder ``recipes`` beside that module.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def recipes(cls) -> Sequence[str]:
        """Names of the recipes that are shipped, sorted."""
        folder = files(cls.__module__.rpartition(".")[0]) / "recipes"
        return sorted(
            Path(entry.name).stem
            for entry in folder.iterdir()
            if entry.name.endswith(".yaml")
        )

    @classmethod
    def read(cls, recipe: str = "", changed: Mapping[str, Any] | None = None) -> Self:
        """Read settings.

        Parameters
        ----------
        recipe
            Name of a shipped recipe, or path of a file; all at their defaults if empty.
        changed
            What is set otherwise, by names of fields.

        Raises
        ------
        ValueError
            If there is no such recipe, or a setting is unknown or impossible; names it.
        """
        data = cls._data(recipe) if recipe else {}
        try:
            return cls.model_validate({**data, **(changed or {})})
        except ValidationError as error:
            told = "; ".join(
                f"{'.'.join(map(str, one['loc']))} = {one['input']!r}: {one['msg']}"
                for one in error.errors()
            )
            raise ValueError(
                f"{recipe or 'settings'}: {told}; settings are "
                f"{', '.join(cls.model_fields)}"
            ) from None

    @classmethod
    def _data(cls, recipe: str) -> dict[str, Any]:
        if recipe in cls.recipes():
            folder = files(cls.__module__.rpartition(".")[0]) / "recipes"
            text = (folder / f"{recipe}.yaml").read_text("utf-8")
        elif Path(recipe).is_file():
            text = read_text(Path(recipe))
        else:
            raise ValueError(
                f"recipe {recipe!r}: is no file, and none of {', '.join(cls.recipes())}"
            )
        try:
            data = yaml.safe_load(text)
        except yaml.YAMLError as error:
            raise ValueError(f"{recipe}: is not YAML ({error})") from None
        if not isinstance(data, dict):
            raise ValueError(f"{recipe}: must be a mapping of settings")
        return data
