"""Lists beside the splits: fixed evaluation samples, and small subsets of the corpus.

Like the splits they are functions of the ids: samples by exponential keys, so that a
larger list contains every smaller one, and a larger corpus displaces few members. The
training samples of a subset begin with the roots of its modifications, so that what was
modified has been seen there as well; a larger subset contains a smaller one if it has
at least as many training samples besides the roots.
"""

import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from mpmworlds.splits.assign import SPLITS, SplitParams, assign
from mpmworlds.splits.ids import SAMPLE_KINDS, SampleId
from mpmworlds.splits.sample import the_first, weighted_order

EVALUATION: Final = {
    "test": "evaluation_test",
    "modification_validation": "evaluation_modification",
}
KEYS: Final = ("salt", "evaluation", "weights", "subsets")
_SUBSET: Final = re.compile(r"[a-z0-9]+", re.ASCII)


@dataclass(frozen=True)
class ListParams:
    """What the lists depend on besides the ids and their splits.

    Attributes
    ----------
    salt
        Text hashed with every id. Another salt is another choice.
    evaluation
        Split -> number of samples in its evaluation list, for the keys of `EVALUATION`.
        Every sample of the split has the same chance.
    weights
        Kind -> weight of a training sample of that kind in a subset. [1]
    subsets
        Name of a subset -> split -> number of samples. Those of the evaluation splits
        are the first of the evaluation lists; those of train, if there are any, begin
        with the roots of the modifications.
    """

    salt: str
    evaluation: Mapping[str, int]
    weights: Mapping[str, float]
    subsets: Mapping[str, Mapping[str, int]]

    @classmethod
    def from_params(cls, params: Mapping[str, Any], name: str) -> "ListParams | None":
        """Read the lists of a profile from the data of ``params.yaml``.

        Parameters
        ----------
        params
            Data of the file.
        name
            Name of the profile.

        Returns
        -------
        ListParams or None
            What the profile's key ``lists`` says; None if it has no such key.

        Raises
        ------
        ValueError
            If there is no such profile, or its lists have keys that are missing or
            unknown, or values that are impossible.
        """
        profiles = params.get("profiles") or {}
        if name not in profiles:
            raise ValueError(
                f"profile {name!r} is not in params.yaml; it has {sorted(profiles)}"
            )
        data = (profiles[name] or {}).get("lists")
        if data is None:
            return None
        start = f"params.yaml: profile {name!r}"
        if not isinstance(data, Mapping) or set(data) != set(KEYS):
            found = sorted(data) if isinstance(data, Mapping) else repr(data)
            raise ValueError(
                f"{start}: lists = {found}, must have the keys {', '.join(KEYS)} and "
                "no other"
            )
        try:
            return cls(**data)
        except ValueError as error:
            raise ValueError(f"{start}: {error}") from None

    def __post_init__(self) -> None:
        """Refuse what cannot be chosen."""
        if not isinstance(self.salt, str) or not self.salt or "\0" in self.salt:
            raise ValueError(
                f"lists salt = {self.salt!r}, must be a non-empty text without NUL"
            )
        _check_counts("lists evaluation", self.evaluation, tuple(EVALUATION))
        if not isinstance(self.weights, Mapping) or set(self.weights) != set(
            SAMPLE_KINDS
        ):
            raise ValueError(
                f"lists weights = {self.weights}, must have the keys "
                f"{', '.join(SAMPLE_KINDS)}"
            )
        for kind, weight in self.weights.items():
            number = isinstance(weight, int | float) and math.isfinite(weight)
            if not number or weight < 0:
                raise ValueError(
                    f"lists weights: {kind} = {weight!r}, must be finite and >= 0"
                )
        if not isinstance(self.subsets, Mapping):
            raise ValueError(f"lists subsets = {self.subsets!r}, must be a mapping")
        for name, counts in self.subsets.items():
            if not _SUBSET.fullmatch(str(name)) or name == "evaluation":
                raise ValueError(
                    f"lists subsets: name {name!r}, must be lower-case letters and "
                    "digits, and not 'evaluation'"
                )
            _check_counts(f"lists subsets: {name}", counts, SPLITS)


def evaluation_order(
    ids: Iterable[str], splits: SplitParams, lists: ListParams
) -> dict[str, list[str]]:
    """Samples of each split that has an evaluation list, as the list takes them."""
    members = assign(ids, splits)
    return {
        split: weighted_order(
            members[split], dict.fromkeys(members[split], 1.0), lists.salt
        )
        for split in EVALUATION
    }


def compute_lists(
    ids: Iterable[str],
    splits: SplitParams,
    lists: ListParams | None = None,
    passed_over: Collection[str] = (),
) -> dict[str, list[str]]:
    """Return every list of a corpus: the splits, then what is chosen from them.

    Parameters
    ----------
    ids
        Sample ids of the corpus, in any order.
    splits
        Salt and fractions of the splits.
    lists
        What to choose; the splits alone if None.
    passed_over
        Ids that are not worth evaluating on.

    Returns
    -------
    dict
        List name -> sorted ids: the members of `SPLITS`; the names in `EVALUATION`;
        ``<subset>_<split>`` for every subset, such as ``10k_train``.

    Raises
    ------
    ValueError
        If an id is not in the grammar or occurs twice, or a split has fewer samples
        than are to be chosen from it, or a subset fewer training samples than roots.
    """
    members = assign(ids, splits)
    if lists is None:
        return members
    chosen, orders = dict(members), {}
    for split, name in EVALUATION.items():
        n = lists.evaluation.get(split, 0)
        worth = [sample for sample in members[split] if sample not in passed_over]
        orders[split] = weighted_order(worth, dict.fromkeys(worth, 1.0), lists.salt)
        chosen[name] = _choose(name, orders[split], n)
    if any(counts.get("train") for counts in lists.subsets.values()):
        weights = {i: lists.weights[SampleId.parse(i).kind] for i in members["train"]}
        orders["train"] = weighted_order(members["train"], weights, lists.salt)
    for subset, counts in lists.subsets.items():
        parts = {
            split: _choose(f"{subset}_{split}", orders[split], counts.get(split, 0))
            for split in EVALUATION
        }
        modified = parts["modification_validation"]
        roots = {SampleId.parse(sample_id).family for sample_id in modified}
        name, n = f"{subset}_train", counts.get("train", 0)
        if absent := sorted(roots - set(members["train"])):
            raise ValueError(
                f"list {name!r}: {absent[0]} is not among the ids, must be: a "
                "modification of it is"
            )
        parts["train"] = _choose(name, orders.get("train", ()), n, roots)
        chosen |= {f"{subset}_{split}": parts[split] for split in SPLITS}
    return chosen


def _choose(
    name: str, order: Sequence[str], n: int, first: Collection[str] = ()
) -> list[str]:
    """Take some ids, then the first others in an order.

    A subset without training samples needs no roots either.
    """
    if n == 0:
        return []
    if n < len(first):
        raise ValueError(
            f"list {name!r}: n = {n} samples, must be at least {len(first)} (the "
            "seeds and parents of its modifications)"
        )
    try:
        more = the_first([i for i in order if i not in first], n - len(first))
    except ValueError as error:
        besides = f", besides {len(first)} seeds and parents" if first else ""
        raise ValueError(f"list {name!r}{besides}: {error}") from None
    return sorted([*first, *more])


def _check_counts(what: str, counts: object, allowed: tuple[str, ...]) -> None:
    """Refuse what is no mapping from names that are allowed to whole numbers."""
    if not isinstance(counts, Mapping):
        raise ValueError(f"{what} = {counts!r}, must be a mapping of numbers by split")
    for split, n in counts.items():
        if split not in allowed:
            raise ValueError(f"{what}: {split!r}, must be one of {', '.join(allowed)}")
        if type(n) is not int or n < 0:
            raise ValueError(f"{what}: {split} = {n!r}, must be a whole number >= 0")
