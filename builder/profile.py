"""What to plan: the numbers of a corpus, as `params.yaml` gives them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from mpmworlds.builder.proposed import Proposed, read_proposals
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
    """

    count: int
    seeds: int = 0
    proposals: tuple[Proposed, ...] = ()

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
    """

    each: int
    more: int = 0

    def __post_init__(self) -> None:
        """Refuse what is no number of samples."""
        _whole("each", self.each, 0)
        _whole("more", self.more, 0)

    def of(self, root: SampleId) -> int:
        """Number for one root, a seed or a parent."""
        first = not root.is_of_seed_family and int(root.family[1:]) < self.more
        return self.each + int(first)


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
        Children of each seed and each parent.
    root_perturbations, child_perturbations
        Perturbations of each seed and parent, and of each child.
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
    """

    root_seed: int
    seeds: tuple[str, ...]
    parents: tuple[Batch, ...]
    children: Count
    root_perturbations: Count
    child_perturbations: Count
    screen: str
    grid_resolution: int
    resolution: int
    duration_frames: int
    split: SplitParams
    proposed_children: tuple[Proposed, ...] = ()

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
            fields |= {key: _count(key, fields[key]) for key in COUNTS}
            if path := fields.get("proposed_children"):
                fields["proposed_children"] = read_proposals(Path(path))
            return cls(
                split=SplitParams(**fields.pop("split")),
                seeds=_seeds(fields.pop("seeds")),
                parents=_batches(fields.pop("parents")),
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
        most = self.children.each + bool(self.children.more)
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
            *range(self.children.of(root)),
            *range(FIRST_PROPOSED, FIRST_PROPOSED + len(self.proposed_of(root))),
        ]
        children = [SampleId(root.family, j) for j in numbers]
        counts = [(root, self.root_perturbations.of(root))]
        counts += [(child, self.child_perturbations.of(root)) for child in children]
        perturbed = [
            SampleId(template.family, template.child, j)
            for template, count in counts
            for j in range(count)
        ]
        return [root, *children, *perturbed]


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


def _count(name: str, data: Any) -> Count:
    if isinstance(data, dict):
        return Count(**data)
    _whole(name, data, 0)
    return Count(data)


def _whole(name: str, value: Any, least: int) -> None:
    if type(value) is not int or value < least:
        raise PlanError(f"{name} = {value!r}, must be a whole number >= {least}")
