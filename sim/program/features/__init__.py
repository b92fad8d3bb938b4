"""What scenes are made of: materials, shapes, motions, emissions, contacts.

Each has a module, with the schema of its feature and all that a program gets of it.
What stands in the folder of a kind is a member of that kind; there is no other list.
"""

import pkgutil
from importlib import import_module
from types import ModuleType
from typing import TypeVar

from mpmworlds.sim.scene.fields import Part

P = TypeVar("P", bound=Part)


def modules_of(kind: str) -> list[ModuleType]:
    """Modules of a kind of feature, such as `materials`, sorted by name."""
    package = import_module(f"{__name__}.{kind}")
    names = sorted(info.name for info in pkgutil.iter_modules(package.__path__))
    return [import_module(f"{package.__name__}.{name}") for name in names]


def members_of(kind: str, base: type[P], key: str) -> dict[str, type[P]]:
    """Schema classes of a kind by the name that the field `key` gives them.

    Raises
    ------
    TypeError
        If a module defines no class of that name, or several.
    """
    found: dict[str, type[P]] = {}
    for module in modules_of(kind):
        name = module.__name__.rpartition(".")[2]
        own = [
            item
            for item in vars(module).values()
            if isinstance(item, type)
            and issubclass(item, base)
            and item.__module__ == module.__name__
            and _named(item, key, name)
        ]
        if len(own) != 1:
            raise TypeError(f"{module.__name__} must define one {kind} {key}: {name}")
        found[name] = own[0]
    return found


def _named(item: type[Part], key: str, name: str) -> bool:
    field = item.model_fields.get(key)
    return field is not None and name in getattr(field.annotation, "__args__", ())
