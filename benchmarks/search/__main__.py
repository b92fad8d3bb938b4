"""Measure program search on samples of development.

python -m benchmarks.search measure --release DIR --out RESULTS  # scores and times
python -m benchmarks.search budget --release DIR --out RESULTS   # what time brings
python -m benchmarks.search luck --release DIR                   # other seeds
python -m benchmarks.search perception --release DIR             # what is seen
python -m benchmarks.search recovery --release DIR RESULTS       # scenes and the truth
python -m benchmarks.search sheets --release DIR RESULTS         # pictures of both
python -m benchmarks.search settled --release DIR RESULTS        # fit of the hedge
"""

import argparse
from pathlib import Path

from benchmarks.search import (
    budget,
    luck,
    measure,
    perception,
    recovery,
    settled,
    sheets,
)

VERBS = {
    "measure": measure,
    "budget": budget,
    "luck": luck,
    "perception": perception,
    "recovery": recovery,
    "sheets": sheets,
    "settled": settled,
}


def main() -> None:
    """Carry out one verb."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    verbs = parser.add_subparsers(required=True)
    for name, module in VERBS.items():
        verb = verbs.add_parser(name, help=(module.__doc__ or "").splitlines()[0])
        verb.add_argument("--release", type=Path, required=True)
        verb.add_argument("--config", default="mini-clips")
        module.add_options(verb)
        verb.set_defaults(carry_out=module.carry_out)
    options = parser.parse_args()
    options.carry_out(options)


if __name__ == "__main__":
    main()
