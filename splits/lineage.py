"""Whether the rows of a corpus say what their ids say, and no lineage is torn apart."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

from mpmworlds.splits.assign import SplitParams, split_of
from mpmworlds.splits.audit_records import Finding, Record
from mpmworlds.splits.ids import SampleId, SampleIdError

Named = list[tuple[SampleId, Record]]


def lineage_findings(
    records: Sequence[Record], params: SplitParams
) -> Iterator[Finding]:
    """Compare lineage and split of every sample with its id.

    Parameters
    ----------
    records
        The samples of a corpus.
    params
        Parameters of the splits.

    Yields
    ------
    Finding
        An id twice or out of the grammar; a kind, origin, family or split that is not
        the id's; an origin or root that is not there; seeds that are not the origin's;
        a family in test and elsewhere; a template apart from its perturbations.
    """
    for sample_id, n in Counter(record.id for record in records).items():
        if n > 1:
            yield Finding("repeated id", (sample_id,), f"{n} rows have it, must be one")
    named: Named = []
    for record in records:
        try:
            named.append((SampleId.parse(record.id), record))
        except SampleIdError as error:
            yield Finding("id", (record.id,), str(error))
    by_id = {record.id: record for record in records}
    for sample, record in named:
        yield from _against_id(sample, record)
        yield from _against_origin(sample, record, by_id)
    yield from _splits(named, params)
    yield from _torn(named)


def _against_id(sample: SampleId, record: Record) -> Iterator[Finding]:
    """Columns that must follow from the id."""
    for column, found, wanted in (
        ("kind", record.kind, sample.kind),
        ("parent_id", record.parent_id, sample.made_from),
        ("family_id", record.family_id, sample.family),
    ):
        if found != wanted:
            detail = f"is {found!r}, must be {wanted!r} by its id"
            yield Finding(column, (record.id,), detail)


def _against_origin(
    sample: SampleId, record: Record, by_id: Mapping[str, Record]
) -> Iterator[Finding]:
    """Origin and root must be there, and hand their seeds down."""
    for ancestor in sorted({sample.made_from, sample.family} - {"", record.id}):
        if ancestor not in by_id:
            detail = f"{ancestor} is not in the corpus, must be: it was made from it"
            yield Finding("ancestor", (record.id,), detail)
    seeds, kind = list(record.seeds), sample.kind
    if kind == "seed":
        held = [name.partition("_")[0] for name in seeds] == [sample.family]
        wanted = "itself alone"
    elif kind == "parent":
        held, wanted = bool(seeds), "at least one"
    else:
        origin = by_id.get(sample.made_from)
        theirs = seeds if origin is None else list(origin.seeds)
        held = set(theirs) <= set(seeds) if kind == "child" else theirs == seeds
        wanted = f"those of {sample.made_from}, {theirs}"
    if not held:
        yield Finding("seeds", (record.id,), f"are {seeds}, must be {wanted}")


def _splits(named: Named, params: SplitParams) -> Iterator[Finding]:
    """Every sample must be in the split of its id."""
    of_template = {
        template: split_of(template, params)
        for template in {sample.template for sample, _ in named}
    }
    for sample, record in named:
        wanted = of_template[sample.template]
        if record.split != wanted:
            detail = f"is {record.split!r}, must be {wanted!r} by its id"
            yield Finding("split", (record.id,), detail)


def _torn(named: Named) -> Iterator[Finding]:
    """Whole families are in test, and templates stay with their perturbations."""
    for family, splits in _places(named, lambda sample: sample.family):
        if "test" in splits and len(splits) > 1:
            yield Finding(
                "family crosses splits",
                tuple(splits.values()),
                f"family {family} is in {', '.join(splits)}, must be in test only or "
                "not at all",
            )
    for template, splits in _places(named, lambda sample: sample.template):
        if len(splits) > 1:
            yield Finding(
                "template crosses splits",
                tuple(splits.values()),
                f"{template} and its perturbations are in {', '.join(splits)}, must be "
                "in one",
            )


def _places(
    named: Iterable[tuple[SampleId, Record]], group: Callable[[SampleId], str]
) -> Iterator[tuple[str, dict[str, str]]]:
    """For each group its splits, sorted, with the first id in each."""
    places: dict[str, dict[str, str]] = defaultdict(dict)
    for sample, record in named:
        splits = places[group(sample)]
        splits[record.split] = min(record.id, splits.get(record.split, record.id))
    for name in sorted(places):
        yield name, dict(sorted(places[name].items()))
