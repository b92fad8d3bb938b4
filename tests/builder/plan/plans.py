"""Profiles that tests of plans share, and a command that plans one of them."""

import dataclasses
import os
import sys
from pathlib import Path

from mpmworlds.builder.plan.profile import Batch, Count, Profile
from mpmworlds.splits.assign import SplitParams

ROOT = Path(__file__).parents[3]
SMALL = Profile(
    root_seed=11,
    seeds=("s02",),
    parents=(Batch(2, 35),),
    children=(Count(1),),
    root_perturbations=(Count(1),),
    child_perturbations=(Count(1),),
    screen="none",
    grid_resolution=64,
    resolution=64,
    duration_frames=5,
    split=SplitParams("test", 0.4, 0.5),
)
GROWN = dataclasses.replace(
    SMALL,
    seeds=("s01", "s02", "s30"),
    parents=(Batch(2, 35), Batch(1, 20)),
    children=(Count(2, more=1),),
    root_perturbations=(Count(2),),
    child_perturbations=(Count(1, more=2),),
)
ONE = dataclasses.replace(SMALL, seeds=(), parents=(Batch(1, 35),))
LONG = dataclasses.replace(
    SMALL, seeds=(), parents=(Batch(6, 35),), root_perturbations=(Count(9),)
)
TRIED = dataclasses.replace(
    SMALL, seeds=(), parents=(Batch(1, 35),), screen="templates"
)
WRITE = """\
import sys
from pathlib import Path
from mpmworlds.builder.plan.plan import write_plan
from tests.builder.plan import plans
profile = getattr(plans, sys.argv[2])
write_plan(profile, Path(sys.argv[1]), workers=int(sys.argv[3]))
"""


def command(path, name, workers):
    """Command that writes the plan of a profile of this module."""
    return [sys.executable, "-c", WRITE, str(path), name, str(workers)]


def environment(**other):
    return os.environ | {"PYTHONPATH": str(ROOT)} | other
