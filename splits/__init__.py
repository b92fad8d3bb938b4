"""Splits as pure functions of sample ids, and the lists that record them."""

from mpmworlds.splits.assign import SPLITS, SplitParams, assign, split_of
from mpmworlds.splits.ids import SampleId, SampleIdError
from mpmworlds.splits.lists import ListParams, compute_lists
from mpmworlds.splits.recorded_lists import (
    SplitListError,
    check,
    read_lists,
    write_lists,
)
from mpmworlds.splits.sample import weighted_sample

__all__ = [
    "SPLITS",
    "ListParams",
    "SampleId",
    "SampleIdError",
    "SplitListError",
    "SplitParams",
    "assign",
    "check",
    "compute_lists",
    "read_lists",
    "split_of",
    "weighted_sample",
    "write_lists",
]
