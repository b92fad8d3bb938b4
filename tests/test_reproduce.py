"""The commands of the pages that reproduce the paper are such as the program takes."""

import inspect
import re
import shlex
from pathlib import Path

import pytest
from accelerate.commands.launch import launch_command_parser

from mpmworlds.baselines.learned.families import FAMILIES, family_named
from mpmworlds.baselines.registry import PREDICTORS
from mpmworlds.cli import parser
from mpmworlds.cli.common import named_values

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted((ROOT / "docs").glob("reproduce*.md"))
GIVEN = {"$regime": "no_materials", "$split": "test"}
VARIABLE = re.compile(r"^\w+=\S+ ")
SHOWN = re.compile(r"^```console\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def commands(word):
    """Lines of the pages that begin with a word, with values for variables."""
    shown = [block for page in PAGES for block in SHOWN.findall(page.read_text())]
    text = "\n".join(shown).replace("\\\n", " ")
    for name, value in GIVEN.items():
        text = text.replace(name, value)
    lines = [VARIABLE.sub("", line.strip()) for line in text.split("\n")]
    return [shlex.split(line)[1:] for line in lines if line.startswith(f"{word} ")]


def check(options):
    """What argparse leaves to others: recipes, settings, options of predictors."""
    if options.name == "train":
        family = family_named(options.family)
        family.TrainingSettings.read(options.recipe, named_values(options.set, "--set"))
    if options.name == "evaluate" and options.predictor in PREDICTORS:
        given = named_values(options.predictor_option, "--predictor-option")
        inspect.signature(PREDICTORS[options.predictor]).bind(**given)


@pytest.mark.parametrize("arguments", commands("mpmworlds"), ids=" ".join)
def test_command_is_understood(arguments):
    check(parser().parse_args(arguments))


@pytest.mark.parametrize("arguments", commands("accelerate"), ids=" ".join)
def test_launch_is_understood(arguments):
    verb, *rest = arguments
    options = launch_command_parser().parse_args(rest)
    assert (verb, options.module, options.training_script) == (
        *("launch", True, "mpmworlds"),
    )
    assert options.config_file is None or (ROOT / options.config_file).is_file()
    check(parser().parse_args(options.training_script_args))


@pytest.mark.parametrize("predictor", ["vlm", "served", "vdm", "vae", "small"])
def test_each_family_is_evaluated_there(predictor):
    assert any(
        ["--predictor", predictor] == arguments[1:3]
        for arguments in commands("mpmworlds")
        if arguments[0] == "evaluate"
    )


@pytest.mark.parametrize("family", FAMILIES)
def test_each_family_is_trained_there(family):
    every = commands("accelerate") + commands("mpmworlds")
    assert any(f" train {family} " in f" {' '.join(arguments)} " for arguments in every)
