"""What the verbs share: exit statuses, messages, parameters."""

import argparse
import json
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

DONE, DOES_NOT_HOLD, WRONG_USE = 0, 1, 2
STORE = Path("work/store")
SCENE_FILE = "a scene (.yaml)"  # in messages
WHOSE = (
    "An id that several corpora have is that of the corpus full, where that is there "
    "(with videos, in a release); --config names another. Which one was taken is said."
)


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
    parser: Any, *, store: bool, default: str | None = "tiny", several: bool = False
) -> None:
    """Add the options that say which corpus, and which store if there is one."""
    what = "profile in params.yaml" + (", or a subset of one" if store else "")
    told = f"default {default}" if default else "default, for a selection: full"
    if several:
        told += "; may be given several times"
        parser.add_argument("--config", action="append", help=f"{what} ({told})")
    else:
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


def add_measured(parser: Any) -> None:
    """Add the option that names what full runs of evaluation samples showed."""
    parser.add_argument(
        "--measured",
        type=Path,
        help="table of `mpmworlds measure` (default: that of the package's profiles)",
    )


def add_samples(parser: Any, split: str) -> None:
    """Add the options that say which samples of a release are meant."""
    parser.add_argument("--release", type=Path, default=Path("release/mpmworlds"))
    parser.add_argument("--config", default="tiny", help="configuration (default tiny)")
    parser.add_argument("--split", default=split, help=f"split (default {split})")


def add_regime(parser: Any) -> None:
    """Add the option that says what is told of the scenes."""
    parser.add_argument(
        "--regime",
        default="frames_only",
        help="what is told of the scenes: frames_only (default), full_config, "
        "no_materials, no_positions or caption",
    )


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


def named_values(given: Sequence[str], option: str) -> Mapping[str, Any]:
    """What was given as NAME=VALUE, values as JSON where they are, else as text.

    Raises
    ------
    ValueError
        If something is not of that form; names the option.
    """
    found: dict[str, Any] = {}
    for item in given:
        key, equals, value = item.partition("=")
        if not equals or not key.isidentifier():
            raise ValueError(f"{option} {item!r}: must be NAME=VALUE")
        try:
            found[key] = json.loads(value)
        except ValueError:
            found[key] = value
    return found


def say_where(sample: str, where: str, others: Sequence[str]) -> None:
    """Say where a sample was taken from, and what else is called so."""
    say(f"{sample}: of {where}")
    if others:
        has = "has another sample" if len(others) == 1 else "have other samples"
        say(
            f"{sample}: {', '.join(others)} {has} of this id; to take that: --config "
            f"{others[0]}"
        )


def say(message: str) -> None:
    """Print a message for the person, beside the results."""
    print(message, file=sys.stderr)


def parameters(options: argparse.Namespace) -> Any:
    """The parameters that the options name."""
    from mpmworlds.builder.parameters import Parameters

    return Parameters.read(options.params, getattr(options, "measured", None))
