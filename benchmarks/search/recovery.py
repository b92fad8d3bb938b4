"""Compare scenes that search found with those of a release.

``python -m benchmarks.search.recovery --release DIR --scenes FOLDER``, where the folder
is what the predictor was given as its option `scenes`.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from mpmworlds.baselines.search.recovery import (
    SAME_PREFIX,
    Match,
    apart_in_prefix,
    matches,
    table,
)
from mpmworlds.files.text import read_text
from mpmworlds.loaders.load import load, neutral_name
from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.sim.scene.scene import Scene


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table, and which prefixes tell no difference."""
    parser = argparse.ArgumentParser(description="Compare found scenes with the truth.")
    parser.add_argument("--release", type=Path, required=True)
    parser.add_argument("--config", default="mini")
    parser.add_argument("--split", default="modification_validation")
    parser.add_argument("--scenes", type=Path, required=True)
    options = parser.parse_args(arguments)
    found: list[Match] = []
    for example in load(options.release, options.split, options.config):
        path = options.scenes / f"{neutral_name(example.id)}.yaml"
        if not path.is_file():
            continue
        truth = Scene.from_yaml(example.row["scene"], example.id)
        scene = Scene.from_yaml(read_text(path), str(path))
        found += matches(truth.to_data(), scene.to_data())
        form = VideoForm.of_row(example.row)
        loss = apart_in_prefix(example.prefix, form, scene)
        word = "differs from" if loss > SAME_PREFIX else "is the same as"
        print(f"{example.id}: its prefix {word} what is seen (loss {loss:.3f})")
    if not found:
        raise SystemExit(f"{options.scenes}: holds no scene of a sample of this split")
    print(table(found))


if __name__ == "__main__":
    main()
