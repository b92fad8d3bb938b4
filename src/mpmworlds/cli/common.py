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


def add_corpus_options(
    parser: Any, *, store: bool, default: str | None = "tiny"
) -> None:
    """Add the options that say which corpus, and which store if there is one."""
    what = "profile in params.yaml" + (", or a subset of one" if store else "")
    told = f"default {default}" if default else "default, for a selection: full"
    parser.add_argument("--config", default=default, help=f"{what} ({told})")
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
        data: Any = yaml.safe_load(read_text(path))
    except yaml.YAMLError as error:
        raise ValueError(f"{path}: is not YAML ({error})") from None
    if isinstance(data, dict) and isinstance(profiles := data.get("profiles"), dict):
        if all(isinstance(profile, dict) for profile in profiles.values()):
            return data
    raise ValueError(
        f"{path}: must be a mapping with the key 'profiles', a mapping of names to "
        "mappings"
    )


def setting(data: dict[str, Any], name: str, kind: type, where: str = "") -> Any:
    """A value of params.yaml, or of a part of it that is said."""
    value = data.get(name)
    if not isinstance(value, kind):
        raise ValueError(
            f"params.yaml: {where}{name} = {value!r}, must be of type {kind.__name__}"
        )
    return value


def named_profile(options: argparse.Namespace) -> Any:
    """The profile that --config names."""
    from mpmworlds.builder.plan.profile import Profile

    params = read_params(options)
    refuse_subset(params, options.config)
    return Profile.from_params(params, options.config)


def refuse_subset(params: dict[str, Any], config: str) -> None:
    """Refuse the name of a subset, where a profile is meant."""
    if whole := _whole_of(params, config):
        raise ValueError(
            f"--config {config}: is a subset of {whole!r}, which this verb takes as a "
            f"whole; say --config {whole}"
        )


def named_subset(options: argparse.Namespace) -> tuple[str, set[str] | None]:
    """Profile and ids of the subset that --config names, or the profile that it is."""
    from mpmworlds.builder.plan.profile import Profile, sample_ids
    from mpmworlds.splits.assign import SPLITS
    from mpmworlds.splits.lists import ListParams, compute_lists

    params, config = read_params(options), options.config
    whole = _whole_of(params, config)
    if whole is None:
        return config, None
    profile = Profile.from_params(params, whole)
    lists = ListParams.from_params(params, whole)
    chosen = compute_lists(sample_ids(profile), profile.split, lists)
    parts = (chosen[f"{config}_{split}"] for split in SPLITS)
    return whole, {sample for part in parts for sample in part}


def _whole_of(params: dict[str, Any], config: str) -> str | None:
    """Name of the profile that has a subset of this name, or None."""
    from mpmworlds.splits.lists import ListParams

    if config in params["profiles"]:
        return None
    for name in sorted(params["profiles"]):
        lists = ListParams.from_params(params, name)
        if lists and config in lists.subsets:
            return str(name)
    return None


def named_lists(options: argparse.Namespace) -> Any:
    """What the profile that --config names chooses from its splits, or None."""
    from mpmworlds.splits.lists import ListParams

    return ListParams.from_params(read_params(options), options.config)
