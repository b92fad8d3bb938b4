"""What the verbs share: exit statuses, messages, parameters."""

import argparse
import sys
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any

DONE, DOES_NOT_HOLD, WRONG_USE = 0, 1, 2
STORE = Path("work/store")


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


def add_corpus_options(parser: Any, *, store: bool) -> None:
    """Add the options that say which corpus, and which store if there is one."""
    parser.add_argument(
        "--config",
        default="tiny",
        help="profile in params.yaml, or a subset of one (default tiny)",
    )
    parser.add_argument("--params", type=Path, help="another params.yaml")
    if store:
        parser.add_argument(
            "--store",
            type=Path,
            default=STORE,
            help=f"folder of rendered samples (default {STORE})",
        )
        add_workers(parser)


def add_workers(parser: Any) -> None:
    """Add the option that says how many processes work."""
    parser.add_argument(
        "--workers", type=int, default=0, help="processes (default: one per core)"
    )


def add_ray(parser: Any) -> None:
    """Add the option that says which cluster works."""
    parser.add_argument(
        "--ray",
        metavar="ADDRESS",
        help="work on a Ray cluster: 'local' starts one, 'auto' or HOST:PORT joins "
        "one, which then has --workers tasks at a time (default: a few per core)",
    )


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
    from mpmworlds.builder.profile import Profile

    return Profile.from_params(read_params(options), options.config)


def named_subset(options: argparse.Namespace) -> tuple[str, set[str] | None]:
    """Profile and ids of the subset that --config names, or the profile that it is."""
    from mpmworlds.builder.profile import Profile, sample_ids
    from mpmworlds.splits.assign import SPLITS
    from mpmworlds.splits.lists import ListParams, compute_lists

    params = read_params(options)
    profiles = params.get("profiles") or {}
    for name in sorted(profiles):
        lists = ListParams.from_params(params, name)
        if options.config in profiles or not lists:
            continue
        if options.config in lists.subsets:
            profile = Profile.from_params(params, name)
            chosen = compute_lists(sample_ids(profile), profile.split, lists)
            parts = (chosen[f"{options.config}_{split}"] for split in SPLITS)
            return name, {sample for part in parts for sample in part}
    return options.config, None


def named_lists(options: argparse.Namespace) -> Any:
    """What the profile that --config names chooses from its splits, or None."""
    from mpmworlds.splits.lists import ListParams

    return ListParams.from_params(read_params(options), options.config)
