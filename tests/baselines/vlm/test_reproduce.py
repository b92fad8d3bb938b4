"""The commands of the page that reproduces the paper are such as the program takes."""

import inspect
import re
import shlex
from pathlib import Path

import pytest
from accelerate.commands.launch import launch_command_parser

from mpmworlds.baselines.learned.families import family_named
from mpmworlds.baselines.registry import PREDICTORS
from mpmworlds.cli import parser
from mpmworlds.cli.common import named_values

ROOT = Path(__file__).resolve().parents[3]
PAGE = (ROOT / "docs" / "reproduce.md").read_text("utf-8")
SHOWN = re.compile(r"^```console\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def commands(word):
    """Lines of the page that begin with a word, with a regime for `$regime`."""
    text = "\n".join(SHOWN.findall(PAGE)).replace("\\\n", " ")
    lines = (
        line.strip() for line in text.replace("$regime", "no_materials").split("\n")
    )
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


def test_the_code_writing_model_is_trained_and_evaluated_there():
    assert any("vlm" in arguments for arguments in commands("accelerate"))
    asked = " ".join(" ".join(arguments) for arguments in commands("mpmworlds"))
    assert "--predictor vlm" in asked and "--predictor served" in asked
