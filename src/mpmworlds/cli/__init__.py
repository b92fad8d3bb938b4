"""The command `mpmworlds`: each verb is one thin function over the library.

Exit status: 0 done; 1 what was asked about does not hold, or a program failed; 2 wrong
use or wrong input; 128 + N ended by signal N, such as 130 by Ctrl-C. Results go to
standard output, progress and messages to standard error.
"""

import argparse
from collections.abc import Callable, Sequence
from contextlib import suppress

import mpmworlds
from mpmworlds.cli import (
    compare,
    corpus,
    doctor,
    evaluate,
    export,
    fetch,
    gallery,
    infer,
    inspect,
    materialise,
    propose,
    publish,
    release,
    report,
    scenes,
    train,
)
from mpmworlds.cli.common import WRONG_USE, say
from mpmworlds.cli.endings import Ended, endings_raised
from mpmworlds.cli.pipes import readers_may_leave
from mpmworlds.files.posix import MODULES, NotPosixError

INTERRUPTED = 130
VERBS = (
    scenes.add_schema,
    scenes.add_link,
    scenes.add_run,
    corpus.add_plan,
    corpus.add_measure,
    corpus.add_splits,
    materialise.add_materialise,
    corpus.add_build,
    propose.add_propose,
    inspect.add_stats,
    inspect.add_audit,
    release.add_verify,
    release.add_regenerate,
    fetch.add_fetch,
    publish.add_publish,
    export.add_export,
    gallery.add_gallery,
    gallery.add_play,
    infer.add_infer,
    compare.add_compare,
    train.add_train,
    evaluate.add_evaluate,
    evaluate.add_submission,
    report.add_report,
    report.add_gate,
    doctor.add_doctor,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb; returns the exit status."""
    options = parser().parse_args(arguments)
    with readers_may_leave():
        return _carried_out(options)


def _carried_out(options: argparse.Namespace) -> int:
    verb: Callable[[argparse.Namespace], int] = options.verb
    try:
        with endings_raised():
            return verb(options)
    except (OSError, ValueError, LookupError, RuntimeError) as error:
        say(f"mpmworlds {options.name}: {_text(error)}")
        return WRONG_USE
    except ModuleNotFoundError as error:
        if error.name not in MODULES:
            raise
        say(f"mpmworlds {options.name}: {NotPosixError(error.name)}")
        return WRONG_USE
    except KeyboardInterrupt:
        say(f"mpmworlds {options.name}: interrupted; run it again to go on")
        return INTERRUPTED
    except Ended as ended:
        with suppress(OSError):  # the terminal may be gone
            say(f"mpmworlds {options.name}: ended by {ended}; run it again to go on")
        return 128 + ended.number


def _text(error: BaseException) -> str:
    if isinstance(error, KeyError) and error.args:
        return str(error.args[0])
    return str(error) or type(error).__name__


def parser() -> argparse.ArgumentParser:
    """Everything that the command understands."""
    whole = argparse.ArgumentParser(
        prog="mpmworlds",
        description="2D Material Point Method worlds as programs, scenes and videos.",
        epilog="`mpmworlds VERB --help` explains a verb and shows an example.",
    )
    whole.add_argument("--version", action="version", version=mpmworlds.__version__)
    verbs = whole.add_subparsers(required=True, metavar="VERB", dest="name")
    for add in VERBS:
        add(verbs)
    return whole
