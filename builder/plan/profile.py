"""What to plan: the numbers of a corpus, as `params.yaml` gives them."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from mpmworlds.builder.plan.proposed import Proposed, read_proposals
from mpmworlds.builder.recipes.tables import (
    FIRST,
    Tables,
    first_tables,
    read_tables,
)
from mpmworlds.splits.assign import SplitParams
from mpmworlds.splits.ids import SampleId

SCREENS: Final = ("none", "parents", "templates")
COUNTS: Final = ("children", "root_perturbations", "child_perturbations")
NOT_PLANNED: Final = ("lists", "rows_per_shard")  # see splits.lists, builder.release
FIRST_PROPOSED: Final = 500  # number of the first proposed child of a root


class PlanError(ValueError):
    """Parameters from which no corpus can be planned."""


@dataclass(frozen=True)
class Batch:
    """Parents that are composed of the same seeds, or were proposed by a model.

    Attributes
    ----------
    count
        How many parents.
    seeds
        They are composed of the first so many seeds; a seed that is added later is
        for later batches, so that no parent changes.
    proposals
        What was proposed, taken in order.
    tables
        Version of the tables that they are drawn from.
    """

    count: int
    seeds: int = 0
    proposals: tuple[Proposed, ...] = ()
    tables: str = FIRST

    def __post_init__(self) -> None:
        """Refuse what cannot be composed."""
        _whole("parents: count", self.count, 0)
        _whole("parents: seeds", self.seeds, 0 if self.proposals else 2)


@dataclass(frozen=True)
class Count:
    """How many samples are made from each of several others.

    Attributes
    ----------
    each
        From each.
    more
        The first so many parents get one more, to make a total.
    tables
        Version of the tables that they are drawn from.
    """

    each: int
    more: int = 0
    tables: str = FIRST

    def __post_init__(self) -> None:
        """Refuse what is no number of samples."""
        _whole("each", self.each, 0)
        _whole("more", self.more, 0)

    def of(self, root: SampleId) -> int:
        """Number for one root, a seed or a parent."""
        first = not root.is_of_seed_family and int(root.family[1:]) < self.more
        return self.each + int(first)


Counts = tuple[Count, ...]  # batches, numbered on from one to the next


def versions(counts: Counts, root: SampleId) -> list[str]:
    """Versions of the tables of all samples that are made for one root, in order."""
    return [count.tables for count in counts for _ in range(count.of(root))]


@dataclass(frozen=True)
class Profile:
    """A corpus to plan: how many scenes of each kind, and at which resolution.

    Attributes
    ----------
    root_seed
        Seed of every random choice.
    seeds
        Ids of the seed scenes that are part of it, such as ``s03``.
    parents
        Batches of composed parents, numbered on from one to the next.
    children
        Children of each seed and each parent, in batches.
    root_perturbations, child_perturbations
        Perturbations of each seed and parent, and of each child, in batches.
    screen
        Which templates must pass a short run, a member of `SCREENS`.
    grid_resolution, resolution
        Cells and pixels per side.
    duration_frames
        Frames of a video.
    split
        Parameters of the splits.
    proposed_children
        Children that were proposed by a model. Those of a root are numbered in order,
        on from `FIRST_PROPOSED`, so that more composed ones leave their ids alone.
    tables
        Those that samples are drawn from, by version.
    """

    root_seed: int
    seeds: tuple[str, ...]
    parents: tuple[Batch, ...]
    children: Counts
    root_perturbations: Counts
    child_perturbations: Counts
    screen: str
    grid_resolution: int
    resolution: int
    duration_frames: int
    split: SplitParams
    proposed_children: tuple[Proposed, ...] = ()
    tables: dict[str, Tables] = field(
        default_factory=lambda: {FIRST: first_tables()}, hash=False
    )

    @classmethod
    def from_params(cls, params: dict[str, Any], name: str) -> "Profile":
        """Read a profile from the data of ``params.yaml``; raises `PlanError`."""
        profiles = params.get("profiles") or {}
        if name not in profiles:
            raise PlanError(
                f"profile {name!r} is not in params.yaml; it has {sorted(profiles)}"
            )
        start = f"params.yaml: profile {name!r}"
        try:
            fields: dict[str, Any] = dict(profiles[name])
            for key in NOT_PLANNED:
                fields.pop(key, None)
            fields |= {key: _counts(key, fields[key]) for key in COUNTS}
            if path := fields.get("proposed_children"):
                fields["proposed_children"] = read_proposals(Path(path))
            parents = _batches(fields.pop("parents"))
            drawn = [*parents, *(count for key in COUNTS for count in fields[key])]
            data, names = params.get("tables"), {batch.tables for batch in drawn}
            return cls(
                split=SplitParams(**fields.pop("split")),
                seeds=_seeds(fields.pop("seeds")),
                parents=parents,
                tables={name: read_tables(data, name) for name in sorted(names)},
                root_seed=params["root_seed"],
                **fields,
            )
        except KeyError as error:
            raise PlanError(f"{start}: {error} is missing; add it") from None
        except (TypeError, ValueError) as error:
            raise PlanError(f"{start}: {error}") from None

    def __post_init__(self) -> None:
        """Refuse what no scene can be planned with."""
        _whole("root_seed", self.root_seed, 0)
        _whole("grid_resolution", self.grid_resolution, 1)
        _whole("resolution", self.resolution, 1)
        _whole("duration_frames", self.duration_frames, 1)
        if self.screen not in SCREENS:
            raise PlanError(
                f"screen = {self.screen!r}, must be one of {', '.join(SCREENS)}"
            )
        most = sum(count.each + bool(count.more) for count in self.children)
        if most > FIRST_PROPOSED:
            raise PlanError(f"children: {most} each, must be <= {FIRST_PROPOSED}")
        roots = set(map(str, self.roots()))
        for proposal in self.proposed_children:
            if proposal.root not in roots:
                raise PlanError(
                    f"proposed_children: {proposal.source}: parent = "
                    f"{proposal.parent!r}, must be the id of a seed or parent of this "
                    "profile; name the scene file of a parent after its id"
                )

    def roots(self) -> list[SampleId]:
        """Seeds, then parents."""
        total = sum(batch.count for batch in self.parents)
        parents = [SampleId.parse(f"p{i:04d}") for i in range(total)]
        return [*map(SampleId.parse, self.seeds), *parents]

    def batch_of(self, parent: SampleId) -> tuple[Batch, int]:
        """Batch that a parent belongs to, and its number in it."""
        number = int(parent.family[1:])
        for batch in self.parents:
            if number < batch.count:
                return batch, number
            number -= batch.count
        raise PlanError(f"{parent}: is in no batch of parents")

    def proposed_of(self, root: SampleId) -> list[Proposed]:
        """Proposed children of a root."""
        return [p for p in self.proposed_children if p.root == str(root)]

    def family(self, root: SampleId) -> list[SampleId]:
        """A root, its children, and the perturbations of all of them."""
        numbers = [
            *range(len(versions(self.children, root))),
            *range(FIRST_PROPOSED, FIRST_PROPOSED + len(self.proposed_of(root))),
        ]
        templates = [root, *(SampleId(root.family, j) for j in numbers)]
        perturbed = [
            SampleId(template.family, template.child, j)
            for template in templates
            for j in range(len(versions(self._perturbations(template), root)))
        ]
        return [*templates, *perturbed]

    def tables_of(self, sample: SampleId) -> Tables:
        """What a parent, a child or a perturbation is drawn from."""
        root = SampleId(sample.family)
        if sample.perturbation is not None:
            counts, number = self._perturbations(sample), sample.perturbation
        elif sample.child is not None:
            counts, number = self.children, sample.child
        else:
            return self.tables[self.batch_of(sample)[0].tables]
        return self.tables[versions(counts, root)[number]]

    def _perturbations(self, sample: SampleId) -> Counts:
        """How many perturbations a root or a child has, or that of this sample."""
        if sample.child is None:
            return self.root_perturbations
        return self.child_perturbations


def sample_ids(profile: Profile) -> list[str]:
    """Ids of a corpus, sorted, without planning its scenes."""
    families = map(profile.family, profile.roots())
    return sorted(str(sample) for family in families for sample in family)


def _seeds(data: Any) -> tuple[str, ...]:
    if not isinstance(data, list) or not all(isinstance(name, str) for name in data):
        raise PlanError(f"seeds = {data!r}, must be a list of ids such as [s00, s07]")
    return tuple(data)


def _batches(data: Any) -> tuple[Batch, ...]:
    if not isinstance(data, list) or not all(isinstance(b, dict) for b in data):
        raise PlanError(
            f"parents = {data!r}, must be a list of mappings such as "
            "{count: 100, seeds: 35}"
        )
    return tuple(map(_batch, data))


def _batch(data: dict[str, Any]) -> Batch:
    if path := data.get("proposals"):
        count = data.get("count")
        _whole("parents: count", count, 1)
        data = data | {"proposals": read_proposals(Path(path), count)}
    return Batch(**data)


def _counts(name: str, data: Any) -> Counts:
    if isinstance(data, list):
        return tuple(count for item in data for count in _counts(name, item))
    if isinstance(data, dict):
        return (Count(**data),)
    _whole(name, data, 0)
    return (Count(data),)


def _whole(name: str, value: Any, least: int) -> None:
    if type(value) is not int or value < least:
        raise PlanError(f"{name} = {value!r}, must be a whole number >= {least}")
