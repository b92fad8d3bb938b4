"""What the verbs share: exit statuses, messages, parameters."""

import argparse
import sys
from collections.abc import Callable
from importlib.resources import files
from typing import Any

DONE, DOES_NOT_HOLD, WRONG_USE = 0, 1, 2


def new_verb(verbs: Any, run: Callable[..., int], what: str, example: str) -> Any:
    """Add a verb that `run` carries out and is named after."""
    parser = verbs.add_parser(
        run.__name__,
        help=what,
        description=f"{what[0].upper()}{what[1:]}.",
        epilog=f"example: {example}",
    )
    parser.set_defaults(verb=run)
    return parser


def say(message: str) -> None:
    """Print a message for the person, beside the results."""
    print(message, file=sys.stderr)


def read_text(path: Any) -> str:
    """Text of a file."""
    try:
        return str(path.read_text("utf-8"))
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: is not UTF-8 text ({error.reason})") from None


def read_params(options: argparse.Namespace) -> dict[str, Any]:
    """The parameters: of --params, or those that come with the package."""
    import yaml

    path = options.params or files("mpmworlds").joinpath("params.yaml")
    try:
        data = yaml.safe_load(read_text(path))
    except yaml.YAMLError as error:
        raise ValueError(f"{path}: is not YAML ({error})") from None
    if not isinstance(data, dict):
        raise ValueError(f"{path}: must be a mapping with the key 'profiles'")
    return data


def setting(params: dict[str, Any], name: str, kind: type) -> Any:
    """A value at the top of params.yaml."""
    value = params.get(name)
    if not isinstance(value, kind):
        raise ValueError(
            f"params.yaml: {name} = {value!r}, must be of type {kind.__name__}"
        )
    return value


def named_profile(options: argparse.Namespace) -> Any:
    """The profile that --config names."""
    from mpmworlds.builder.plan import Profile

    return Profile.from_params(read_params(options), options.config)
