"""Scenes that search found, compared with the truth by families of materials."""

import argparse

from benchmarks.search.drawn import add_results, pairs

from mpmworlds.baselines.search.recovery import (
    SAME_PREFIX,
    Match,
    apart_in_prefix,
    matches,
    table,
)
from mpmworlds.loaders.prompts import VideoForm
from mpmworlds.sim.scene.scene import Scene


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what is compared."""
    add_results(parser)


def carry_out(options: argparse.Namespace) -> None:
    """Print the table, and which prefixes tell no difference."""
    found: list[Match] = []
    for pair in pairs(options):
        truth = Scene.from_yaml(pair.example.row["scene"], pair.example.id)
        found += matches(truth.to_data(), pair.scene.to_data())
        form = VideoForm.of_row(pair.example.row)
        loss = apart_in_prefix(pair.example.prefix, form, pair.scene)
        word = "differs from" if loss > SAME_PREFIX else "is the same as"
        print(f"{pair.example.id}: its prefix {word} what is seen (loss {loss:.3f})")
    print(table(found))
